// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/surface_mesh.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon::precompute {

/// Reads the lines of a text file one after the other, and splits them into words.
class TextLines {
 public:
  explicit TextLines(const std::string& bytes) : rest_(bytes) {}

  /// Takes the next line unchanged. Returns false at the end.
  bool Next(std::string_view& line) {
    if (rest_.empty()) return false;
    const size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    return true;
  }

  /// Returns the words of the next line that has words before a '#'. Returns no words at the end.
  std::vector<std::string_view> NextWords() {
    std::string_view line;
    while (Next(line)) {
      std::vector<std::string_view> words = Words(line.substr(0, line.find('#')));
      if (!words.empty()) return words;
    }
    return {};
  }

  static std::vector<std::string_view> Words(std::string_view line) {
    std::vector<std::string_view> words;
    for (size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
      const size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      begin = line.find_first_not_of(kBlanks, end);
    }
    return words;
  }

  /// Returns the number of the line taken last, counted from 1.
  int number() const { return number_; }
  /// Returns where the line taken last is, such as "line 5" or "line 5 of "nodes.inc"".
  std::string place() const {
    return absl::StrCat("line ", number_,
                        file_.empty() ? "" : absl::StrCat(" of ", QuotedText(file_)));
  }
  /// Says that the next line is a line of another file, which the text contains. No name is the
  /// text's own file.
  void GoOnAt(int line, std::string_view file) {
    number_ = line - 1;
    file_ = file;
  }

  /// Returns the text after the line taken last.
  std::string_view rest() const { return rest_; }
  void Skip(size_t bytes) { rest_.remove_prefix(bytes); }

  absl::Status Unreadable(absl::string_view what) const {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
        absl::StrCat(place(), ": ", what, ": export the mesh again, or name its right format"));
  }

 private:
  static constexpr std::string_view kBlanks = " \t\r\v\f";
  std::string_view rest_;
  int number_ = 0;
  std::string file_;
};

/// Reads the next line of an OBJ file, joined with the lines that continue it after a '\' at the
/// end.
inline bool NextObjLine(TextLines& lines, std::string& joined) {
  std::string_view line;
  if (!lines.Next(line)) return false;
  joined = line;
  while (joined.ends_with('\\') && lines.Next(line)) {
    joined.pop_back();
    joined += line;
  }
  return true;
}

/// Converts the whole word, such as "1e-3" or "-inf", to a number. Returns nullopt if the word is
/// not a number.
template <typename T>
std::optional<T> ToNumber(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range) {
    // A number between zero and the least above it is zero.
    if constexpr (std::is_floating_point_v<T>) {
      const bool is_small =
          word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
      return is_small ? 0 : HUGE_VAL;
    }
  }
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Takes the first three of at least three words as a point.
inline absl::StatusOr<Point> TakePoint(const TextLines& lines,
                                       std::span<const std::string_view> words) {
  Point p{};
  for (size_t x = 0; x < 3; ++x) {
    const std::optional<double> coordinate = ToNumber<double>(words[x]);
    if (!coordinate) {
      return lines.Unreadable(absl::StrCat(QuotedText(words[x]), " is no coordinate"));
    }
    if (!std::isfinite(*coordinate)) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_NOT_FINITE",
                     absl::StrCat("line ", lines.number(), ": a vertex has the coordinate ",
                                  QuotedText(words[x]), ": give it finite coordinates"));
    }
    p[x] = *coordinate;
  }
  return p;
}

}  // namespace carillon::precompute
