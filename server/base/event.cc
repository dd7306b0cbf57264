// SPDX-License-Identifier: Apache-2.0
#include "server/base/event.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/string_view.h"

namespace carillon {
namespace {

constexpr size_t kLongestValue = 200;
constexpr absl::string_view kCutMark = "...";

std::string Cut(absl::string_view value) {
  if (value.size() <= kLongestValue) return std::string(value);
  return absl::StrCat(value.substr(0, kLongestValue - kCutMark.size()), kCutMark);
}

bool IsPlain(absl::string_view value) {
  return !value.empty() && std::ranges::all_of(value, [](char byte) {
    return absl::ascii_isgraph(static_cast<unsigned char>(byte)) &&
           absl::string_view("\"\\=").find(byte) == absl::string_view::npos;
  });
}

std::string InLine(const std::string& value) {
  if (IsPlain(value)) return value;
  // Within double quotes a single quote needs no escape.
  return absl::StrCat("\"", absl::StrReplaceAll(absl::CHexEscape(value), {{"\\'", "'"}}), "\"");
}

}  // namespace

Event& Event::With(std::string key, const absl::AlphaNum& value) {
  fields_.push_back({.key = std::move(key), .value = Cut(value.Piece())});
  return *this;
}

Event& Event::WithSome(std::string key, const std::string& value) {
  return value.empty() ? *this : With(std::move(key), value);
}

std::string Event::ToLine() const {
  std::string line = name_;
  for (const Field& field : fields_)
    absl::StrAppend(&line, " ", field.key, "=", InLine(field.value));
  return line;
}

}  // namespace carillon
