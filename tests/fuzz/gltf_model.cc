// SPDX-License-Identifier: Apache-2.0
// Reads the input as a modal model in a glTF, text or binary.
#include "client_sdk/interchange/gltf_model.h"

#include <cstdint>

#include "tests/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const carillon::MemoryFile file(data, size);
  carillon::v1::Material material;
  material.set_preset("chime_aluminum");
  carillon::interchange::ReadGltfModel(file.path(), "", material).IgnoreError();
  return 0;
}
