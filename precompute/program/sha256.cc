// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/sha256.h"

#include <openssl/evp.h>

#include "absl/strings/escaping.h"

namespace carillon::precompute {

std::string Sha256Hex(const std::string& bytes) {
  std::string digest(32, '\0');
  EVP_Digest(bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(digest.data()), nullptr,
             EVP_sha256(), nullptr);
  return absl::BytesToHexString(digest);
}

}  // namespace carillon::precompute
