// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/escaped_text.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/utf8.h"

namespace carillon {
namespace {

/// Returns the number of bytes of the character with which `text` begins, or 0 if the bytes are not
/// UTF-8. `code` gets the character.
size_t ReadCharacter(std::string_view text, uint32_t& code) {
  const auto first = static_cast<unsigned char>(text.front());
  size_t size = 1;
  if (first >= 0xC2) size = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if ((first >= 0x80 && first < 0xC2) || first > 0xF4 || text.size() < size) return 0;
  code = size == 1 ? first : first & (0x7FU >> size);
  for (size_t i = 1; i < size; ++i) {
    if (!ContinuesCharacter(text[i])) return 0;
    code = (code << 6U) | (static_cast<unsigned char>(text[i]) & 0x3FU);
  }
  constexpr uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  return code < kLeast[size] || surrogate || code > 0x10FFFF ? 0 : size;
}

/// Whether a terminal would act on the character, or write the text after it in another direction.
bool Controls(uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x61C || code == 0x200E ||
         code == 0x200F || (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string EscapedText(std::string_view text) {
  std::string escaped;
  while (!text.empty()) {
    uint32_t code = 0;
    const size_t size = ReadCharacter(text, code);
    if (size > 0 && !Controls(code)) {
      escaped.append(text.substr(0, size));
    } else {
      for (const char byte : text.substr(0, size > 0 ? size : 1)) {
        absl::StrAppendFormat(&escaped, "\\x%02x", static_cast<unsigned char>(byte));
      }
    }
    text.remove_prefix(size > 0 ? size : 1);
  }
  return escaped;
}

std::string QuotedText(std::string_view text) {
  constexpr size_t kMostBytes = 60;
  size_t end = std::min(text.size(), kMostBytes);
  while (end > 0 && end < text.size() && ContinuesCharacter(text[end])) --end;
  return absl::StrCat("\"", EscapedText(text.substr(0, end)), end < text.size() ? "...\"" : "\"");
}

}  // namespace carillon
