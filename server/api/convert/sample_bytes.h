// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace carillon {

/// Returns samples in the encoding of the contract: IEEE 754 binary32, little endian.
inline std::string ToBytes(std::span<const float> samples) {
  static_assert(std::endian::native == std::endian::little, "add a byte swap for this machine");
  return {reinterpret_cast<const char*>(samples.data()), samples.size_bytes()};
}

/// Returns samples as integers of 16 bits, little endian; full scale is 32767, and samples beyond
/// full scale are clipped.
inline std::string ToInt16Bytes(std::span<const float> samples) {
  std::vector<int16_t> integers(samples.size());
  std::ranges::transform(samples, integers.begin(), [](float sample) {
    return static_cast<int16_t>(std::lround(std::clamp(sample, -1.0F, 1.0F) * 32767));
  });
  return {reinterpret_cast<const char*>(integers.data()), integers.size() * sizeof(int16_t)};
}

}  // namespace carillon
