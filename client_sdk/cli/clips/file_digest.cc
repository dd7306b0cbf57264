// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/clips/file_digest.h"

#include <openssl/evp.h>

#include <array>
#include <fstream>
#include <memory>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {

absl::StatusOr<std::string> FileDigest(const std::string& path) {
  constexpr size_t kPieceBytes = size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest(EVP_MD_CTX_new(),
                                                                       &EVP_MD_CTX_free);
  EVP_DigestInit_ex(digest.get(), EVP_sha256(), nullptr);
  std::vector<char> piece(kPieceBytes);
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    EVP_DigestUpdate(digest.get(), piece.data(), static_cast<size_t>(file.gcount()));
  }
  if (!file.eof()) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, ": cannot be read; check the path and its permissions"));
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes;
  unsigned int count = 0;
  EVP_DigestFinal_ex(digest.get(), bytes.data(), &count);
  return absl::BytesToHexString({reinterpret_cast<const char*>(bytes.data()), count});
}

}  // namespace carillon::cli
