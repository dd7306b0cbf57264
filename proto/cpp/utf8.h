// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Returns whether the byte continues a character of UTF-8 text that began before it.
constexpr bool ContinuesCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U;
}

}  // namespace carillon
