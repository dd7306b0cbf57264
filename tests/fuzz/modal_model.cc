// SPDX-License-Identifier: Apache-2.0
// Reads the input as the records of a stored modal model: as they are, and with right hashes, since
// random changes would not get past a wrong one.
#include <cstdint>
#include <optional>
#include <string>

#include "server/base/xxh3.h"
#include "server/mode_database/codec/model_codec.h"
#include "tests/fuzz/memory_file.h"

namespace carillon {
namespace {

absl::Status Decode(int descriptor, bool mend_hashes) {
  ModelFileReader reader(descriptor);
  ModelDecoder decoder;
  while (true) {
    absl::StatusOr<std::optional<v1::ModalModelRecord>> record = reader.Next();
    if (!record.ok()) return record.status();
    if (!record->has_value()) return decoder.Finish(std::string(64, 'a')).status();
    if (mend_hashes && (*record)->has_chunk()) {
      v1::ModalModelChunk& chunk = *(*record)->mutable_chunk();
      chunk.set_xxh3(Xxh3(chunk.data()));
    }
    if (absl::Status status = decoder.Append(**record); !status.ok()) return status;
  }
}

}  // namespace
}  // namespace carillon

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  for (const bool mend_hashes : {false, true}) {
    const carillon::MemoryFile file(data, size);
    carillon::Decode(file.descriptor(), mend_hashes).IgnoreError();
  }
  return 0;
}
