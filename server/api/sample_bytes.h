// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <span>
#include <string>

namespace carillon {

/// Returns samples in the encoding of the contract: IEEE 754 binary32, little endian.
inline std::string ToBytes(std::span<const float> samples) {
  static_assert(std::endian::native == std::endian::little, "add a byte swap for this machine");
  return {reinterpret_cast<const char*>(samples.data()), samples.size_bytes()};
}

}  // namespace carillon
