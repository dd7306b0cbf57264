// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/clean_surface_file.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

// The file begins with "glTF", its version and its length. Each chunk begins with its length and
// its kind; version 1 has one chunk, and bytes without a length behind it.
constexpr size_t kFileHeader = 12, kChunkHeader = 8, kVersionAt = 4;

uint32_t NumberAt(const std::string& bytes, size_t at) {
  uint32_t number = 0;  // little-endian, as this machine
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

}  // namespace

absl::Status CheckGlb(const std::string& bytes) {
  if (bytes.size() < kFileHeader + kChunkHeader || !absl::StartsWith(bytes, "glTF")) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   "a GLB file begins with \"glTF\", a header of 12 bytes and a chunk: export it "
                   "again");
  }
  for (size_t at = kFileHeader; at + kChunkHeader <= bytes.size();) {
    const size_t length = NumberAt(bytes, at);
    const size_t left = bytes.size() - at - kChunkHeader;
    if (length > left) {
      return Refusal(
          absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
          absl::StrCat("the chunk at byte ", at, " of the GLB file says that it has ", length,
                       " bytes, and the file has ", left, " more: export it again"));
    }
    if (NumberAt(bytes, kVersionAt) == 1) break;
    at += kChunkHeader + length;
  }
  return absl::OkStatus();
}

}  // namespace carillon::precompute
