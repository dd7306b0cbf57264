// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "precompute/mesh/read/text/text_lines.h"

namespace carillon::precompute {

/// Returns the number, counted from 1, of the line of `text` in which its part `rest` begins.
inline int64_t LineOf(std::string_view text, std::string_view rest) {
  return 1 + std::count(text.begin(), text.end() - static_cast<ptrdiff_t>(rest.size()), '\n');
}

/// Reads numbers one after the other, from the words of a text (a '#' begins a comment that ends
/// with the line) or from bytes in the machine's own representation.
class NumberStream {
 public:
  NumberStream(std::string_view bytes, bool is_binary) : rest_(bytes), is_binary_(is_binary) {}

  /// Takes the next number. Returns false if the next word is not a number of type T, or at the
  /// end.
  template <typename T>
  bool Take(T& value) {
    if (is_binary_) return TakeBytes(value);
    const std::optional<T> number = ToNumber<T>(NextWord());
    if (number) value = *number;
    return number.has_value();
  }

  template <typename Range>
  bool TakeAll(Range& values) {
    for (auto& value : values) {
      if (!Take(value)) return false;
    }
    return true;
  }

  /// Takes the next word of a text. Returns an empty word at the end.
  std::string_view NextWord() {
    const std::string_view word = PeekWord();
    rest_.remove_prefix(word.size());
    return word;
  }

  /// Returns the next word without taking it.
  std::string_view PeekWord() {
    SkipBlanks();
    return rest_.substr(0, std::min(rest_.find_first_of(" \t\r\v\f\n#"), rest_.size()));
  }

  /// Skips the rest of the line of a text.
  void SkipLine() { rest_.remove_prefix(std::min(rest_.find_first_of("\r\n"), rest_.size())); }

  std::string_view rest() const { return rest_; }

 private:
  template <typename T>
  bool TakeBytes(T& value) {
    if (rest_.size() < sizeof value) return false;
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_.remove_prefix(sizeof value);
    return true;
  }

  void SkipBlanks() {
    while (!rest_.empty()) {
      rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\v\f\n"), rest_.size()));
      if (!rest_.starts_with('#')) return;
      rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
    }
  }

  std::string_view rest_;
  bool is_binary_;
};

}  // namespace carillon::precompute
