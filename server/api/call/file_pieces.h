// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "server/api/call/stream_call.h"

namespace carillon {

/// A file, read piece by piece for a stream.
class FilePieces {
 public:
  /// The file may be removed once it is open.
  void Open(const std::filesystem::path& path) { file_.open(path, std::ios::binary); }

  /// Fills `data` with the next piece.
  Supply Next(std::string& data) {
    constexpr size_t kPieceBytes = 1 << 20;
    data.resize(kPieceBytes);
    file_.read(data.data(), static_cast<std::streamsize>(data.size()));
    data.resize(static_cast<size_t>(file_.gcount()));
    return data.empty() ? Supply::kEnd : Supply::kMessage;
  }

 private:
  std::ifstream file_;
};

}  // namespace carillon
