// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/admission.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace carillon::console {
namespace {

std::string RandomWord() {
  std::array<unsigned char, 32> bytes;
  // Without randomness there is no admission.
  if (RAND_bytes(bytes.data(), bytes.size()) != 1) std::abort();
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

bool IsEqual(std::string_view one, std::string_view other) {
  return one.size() == other.size() && CRYPTO_memcmp(one.data(), other.data(), one.size()) == 0;
}

}  // namespace

Admission::Admission(uint16_t port)
    : token_(RandomWord()), cookie_name_(absl::StrCat("carillon-", port)), cookie_(RandomWord()) {}

bool Admission::IsToken(std::string_view given) const { return IsEqual(given, token_); }

std::string Admission::SetCookie() const {
  return absl::StrCat(cookie_name_, "=", cookie_, "; HttpOnly; SameSite=Strict; Path=/");
}

bool Admission::HasCookie(std::string_view cookies) const {
  while (!cookies.empty()) {
    std::string_view pair = cookies.substr(0, cookies.find(';'));
    cookies.remove_prefix(std::min(cookies.size(), pair.size() + 1));
    pair.remove_prefix(std::min(pair.size(), pair.find_first_not_of(' ')));
    const size_t equals = std::min(pair.size(), pair.find('='));
    if (pair.substr(0, equals) == cookie_name_ &&
        IsEqual(pair.substr(std::min(pair.size(), equals + 1)), cookie_)) {
      return true;
    }
  }
  return false;
}

bool Admission::IsOwnHost(std::string_view host) {
  for (const std::string_view name : {"localhost", "127.0.0.1", "[::1]"}) {
    if (!host.starts_with(name)) continue;
    const std::string_view port = host.substr(name.size());
    // From another machine, a forwarded port may have any number.
    return port.empty() || (port.size() > 1 && port.front() == ':' &&
                            port.find_first_not_of("0123456789", 1) == std::string_view::npos);
  }
  return false;
}

bool Admission::IsOwnOrigin(std::string_view origin, std::string_view host) {
  constexpr std::string_view kScheme = "http://";
  return !host.empty() && origin.starts_with(kScheme) && origin.substr(kScheme.size()) == host;
}

}  // namespace carillon::console
