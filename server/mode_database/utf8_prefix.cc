// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/utf8_prefix.h"

#include "proto/cpp/utf8.h"

namespace carillon {
namespace {

/// Bytes of the letter that begins with this byte.
size_t LetterBytes(unsigned char first) {
  if (first >= 0xF0) return 4;
  if (first >= 0xE0) return 3;
  return first >= 0xC0 ? 2 : 1;
}

}  // namespace

std::string Utf8Prefix(std::string_view text, size_t max_bytes) {
  text = text.substr(0, max_bytes);
  size_t last = text.size();
  while (last > 0 && ContinuesCharacter(text[last - 1])) --last;
  if (last == 0) return std::string(text.substr(0, 0));
  const size_t begin = last - 1;
  const bool whole = begin + LetterBytes(static_cast<unsigned char>(text[begin])) <= text.size();
  return std::string(whole ? text : text.substr(0, begin));
}

}  // namespace carillon
