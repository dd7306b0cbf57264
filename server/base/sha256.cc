// SPDX-License-Identifier: Apache-2.0
#include "server/base/sha256.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cassert>

namespace carillon {

struct Sha256::Context {
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> md{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
};

Sha256::Sha256() : context_(std::make_unique<Context>()) {
  [[maybe_unused]] const int ok = EVP_DigestInit_ex(context_->md.get(), EVP_sha256(), nullptr);
  assert(ok == 1);
}

Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

void Sha256::Update(std::string_view bytes) {
  [[maybe_unused]] const int ok = EVP_DigestUpdate(context_->md.get(), bytes.data(), bytes.size());
  assert(ok == 1);
}

std::string Sha256::Finish() {
  std::array<unsigned char, 32> digest;
  [[maybe_unused]] const int ok = EVP_DigestFinal_ex(context_->md.get(), digest.data(), nullptr);
  assert(ok == 1);
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  for (const unsigned char byte : digest) {
    hex.push_back(kDigits[byte >> 4U]);
    hex.push_back(kDigits[byte & 15U]);
  }
  return hex;
}

std::string Sha256Hex(std::string_view bytes) {
  Sha256 sha;
  sha.Update(bytes);
  return sha.Finish();
}

bool IsSha256Hex(std::string_view text) {
  return text.size() == 64 && std::ranges::all_of(text, [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

}  // namespace carillon
