// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {

/// Hexadecimal digits that nobody can guess, eight for each word, from the system's own source.
inline std::string RandomDigits(int word_count) {
  std::random_device random;
  std::string digits;
  for (int i = 0; i < word_count; ++i) {
    absl::StrAppend(&digits, absl::Hex(uint32_t{random()}, absl::kZeroPad8));
  }
  return digits;
}

}  // namespace carillon
