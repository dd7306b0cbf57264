// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace carillon {

/// SHA-256 of bytes that arrive in pieces.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void Update(std::string_view bytes);

  /// Returns the digest of all bytes added, 64 lower-case hexadecimal digits. Must be the last
  /// call.
  std::string Finish();

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

/// Returns the digest of `bytes`, 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);

/// Returns whether `text` has the form of a digest: 64 lower-case hexadecimal digits.
bool IsSha256Hex(std::string_view text);

}  // namespace carillon
