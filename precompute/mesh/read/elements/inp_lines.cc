// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/inp_lines.h"

#include <algorithm>
#include <cctype>

#include "absl/strings/ascii.h"
#include "precompute/mesh/read/text/text_lines.h"

namespace carillon::precompute {
namespace {

std::string_view Stripped(std::string_view text) {
  constexpr std::string_view kInpBlanks = " \t\r\v\f";
  const size_t begin = std::min(text.find_first_not_of(kInpBlanks), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(kInpBlanks) + 1);
}

/// Splits at commas that are not within quotation marks.
std::vector<std::string_view> Parts(std::string_view line) {
  std::vector<std::string_view> parts;
  bool quoted = false;
  size_t begin = 0;
  for (size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') quoted = !quoted;
    if (i < line.size() && (line[i] != ',' || quoted)) continue;
    parts.push_back(Stripped(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  return parts;
}

/// "END  Part" as "END PART".
std::string KeywordName(std::string_view words) {
  std::string name;
  for (const std::string_view word : TextLines::Words(words)) {
    if (!name.empty()) name += ' ';
    name += absl::AsciiStrToUpper(std::string(word));
  }
  return name;
}

}  // namespace

InpKeyword ParseInpKeyword(std::string_view line) {
  InpKeyword keyword;
  for (const std::string_view part : Parts(line.substr(1))) {
    const size_t sign = std::min(part.find('='), part.size());
    std::string_view value = Stripped(part.substr(std::min(sign + 1, part.size())));
    if (value.size() > 1 && value.front() == '"' && value.back() == '"') {
      value = value.substr(1, value.size() - 2);
    }
    const std::string name = KeywordName(part.substr(0, sign));
    if (keyword.name.empty()) {
      keyword.name = name;
    } else if (!name.empty()) {
      keyword.parameters[name] = std::string(value);
    }
  }
  return keyword;
}

std::vector<std::string_view> InpFields(std::string_view line) {
  std::vector<std::string_view> fields = Parts(line);
  if (fields.back().empty()) fields.pop_back();
  return fields;
}

std::optional<double> InpReal(std::string_view field) {
  if (field.empty()) return 0;
  std::string plain;
  for (const char c : field) {
    const bool has_sign_alone =
        (c == '+' || c == '-') && !plain.empty() && plain.find('e') == std::string::npos;
    if (has_sign_alone) plain += 'e';
    const bool is_exponent = c == 'd' || c == 'D' || c == 'E';
    plain += is_exponent ? 'e' : c;
  }
  return ToNumber<double>(plain);
}

std::string InpName(std::string_view name) { return absl::AsciiStrToUpper(std::string(name)); }

}  // namespace carillon::precompute
