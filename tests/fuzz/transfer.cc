// SPDX-License-Identifier: Apache-2.0
// Reads the input as the records of a stored transfer, and decodes an accepted one as the server
// does.
#include <cstdint>
#include <string>

#include "server/mode_database/codec/transfer_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto stored =
      carillon::StoredTransfer::Parse(std::string(reinterpret_cast<const char*>(data), size));
  if (!stored.ok()) return 0;
  stored->Eigenvalues();
  stored->Decode();
  stored->Records();
  return 0;
}
