// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/reason_catalogue.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/near_names.h"

namespace carillon {
namespace {

constexpr char kPages[] =
#include "reasons.inc"
    ;

bool IsName(absl::string_view cell) {
  return !cell.empty() && std::ranges::all_of(cell, [](unsigned char c) {
    return absl::ascii_isupper(c) || absl::ascii_isdigit(c) || c == '_';
  });
}

/// Returns the text of a cell without the targets of its links: "[after X](#after-x)" becomes
/// "'after X' in docs/troubleshoot.md", and a link to another page names the page.
std::string WithoutLinks(std::string cell) {
  for (size_t middle = cell.find("]("); middle != std::string::npos; middle = cell.find("](")) {
    const size_t begin = cell.rfind('[', middle), end = cell.find(')', middle);
    if (begin == std::string::npos || end == std::string::npos) break;
    const std::string text = cell.substr(begin + 1, middle - begin - 1);
    std::string page = cell.substr(middle + 2, end - middle - 2);
    page = page.substr(0, page.find('#'));
    cell.replace(begin, end + 1 - begin,
                 absl::StrCat("'", text, "' in docs/", page.empty() ? "troubleshoot.md" : page));
  }
  return cell;
}

/// Reads the rows of the groups of reasons (name, codes, meaning, repair), of the section
/// "Warnings" (name, meaning, counts, figures, repair), and of findings (name, meaning, repair).
std::vector<CatalogueReason> ReadTables() {
  std::vector<CatalogueReason> reasons;
  absl::string_view group;
  for (const absl::string_view line : absl::StrSplit(kPages, '\n')) {
    if (absl::StartsWith(line, "## ")) group = line.substr(3);
    const std::vector<std::string> cells = absl::StrSplit(line, " | ");
    if (cells.size() < 3 || cells.size() > 5 || !absl::StartsWith(line, "| ")) continue;
    const std::string name = cells[0].substr(2);
    if (!IsName(name)) continue;
    CatalogueReason& reason = reasons.emplace_back();
    reason.name = name;
    reason.group = std::string(group);
    const bool has_code = cells.size() == 4;
    if (has_code) reason.code = cells[1];
    reason.meaning = WithoutLinks(cells[has_code ? 2 : 1]);
    reason.repair = WithoutLinks(std::string(absl::StripSuffix(cells.back(), " |")));
  }
  return reasons;
}

/// Returns the names that have the most words of `name`, for instance MESH_NOT_CLOSED for
/// CLOSED_MESH. Returns no names if none has one.
std::vector<std::string> NamesWithWordsOf(const std::string& name,
                                          const std::vector<std::string>& names) {
  const std::vector<std::string> wanted = absl::StrSplit(name, '_', absl::SkipEmpty());
  std::vector<std::string> best;
  std::ptrdiff_t most = 1;
  for (const std::string& other : names) {
    const std::vector<std::string> words = absl::StrSplit(other, '_');
    const std::ptrdiff_t common = std::ranges::count_if(
        wanted, [&](const std::string& word) { return std::ranges::count(words, word) > 0; });
    if (common > most) best.clear();
    if (common >= most) best.push_back(other);
    most = std::max(most, common);
  }
  return best;
}

}  // namespace

const std::vector<CatalogueReason>& Reasons() {
  static const std::vector<CatalogueReason> reasons = ReadTables();
  return reasons;
}

absl::StatusOr<CatalogueReason> FindReason(const std::string& text) {
  const std::string name = absl::AsciiStrToUpper(text.substr(0, text.find(':')));
  std::vector<std::string> names;
  for (const CatalogueReason& reason : Reasons()) {
    if (reason.name == name) return reason;
    names.push_back(reason.name);
  }
  std::vector<std::string> near = NearNames(name, names);
  if (near.empty()) near = NamesWithWordsOf(name, names);
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
      absl::StrCat("there is no reason ", name, "; ",
                   near.empty() ? "`carillon explain` lists all"
                                : absl::StrCat("did you mean ", absl::StrJoin(near, " or "), "?")));
}

}  // namespace carillon
