// SPDX-License-Identifier: Apache-2.0
// Reads the input as one array of NumPy, of each type that a model has. In an archive, few random
// changes would get past the checksums.
#include <cstdint>
#include <string>
#include <vector>

#include "client_sdk/interchange/npy_array.h"

namespace carillon::interchange {
namespace {

template <typename T>
void Read(const NpyArray& array) {
  std::vector<T> numbers;
  ToNumbers("input", array, numbers).IgnoreError();
}

}  // namespace
}  // namespace carillon::interchange

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace carillon::interchange;  // NOLINT(google-build-using-namespace)
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const auto array = ParseNpy("input", bytes);
  if (!array.ok()) return 0;
  Read<double>(*array);
  Read<float>(*array);
  Read<uint32_t>(*array);
  ToText("input", *array).IgnoreError();
  return 0;
}
