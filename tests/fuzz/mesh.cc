// SPDX-License-Identifier: Apache-2.0
// Reads the input as a mesh of the format that the build defines.
#include <cstdint>
#include <string>

#include "precompute/mesh/read/read_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  carillon::precompute::ParseMesh(bytes, CARILLON_MESH_FORMAT, 1).IgnoreError();
  return 0;
}
