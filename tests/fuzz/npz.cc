// SPDX-License-Identifier: Apache-2.0
// Reads the input as a modal model in NumPy's format.
#include <cstdint>

#include "client_sdk/interchange/npz_model.h"
#include "tests/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const carillon::MemoryFile file(data, size);
  carillon::interchange::ReadNpz(file.path()).IgnoreError();
  return 0;
}
