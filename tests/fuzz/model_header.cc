// SPDX-License-Identifier: Apache-2.0
// Reads the input as the JSON of a model's header.
#include <cstdint>
#include <string>

#include "client_sdk/interchange/header_json.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  carillon::interchange::HeaderFromJson(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
