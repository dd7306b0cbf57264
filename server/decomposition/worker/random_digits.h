// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {

/// Returns unpredictable hexadecimal digits from the system's random source, eight for each word.
inline std::string RandomDigits(int word_count) {
  std::random_device random;
  std::string digits;
  for (int i = 0; i < word_count; ++i) {
    absl::StrAppend(&digits, absl::Hex(uint32_t{random()}, absl::kZeroPad8));
  }
  return digits;
}

}  // namespace carillon
