// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/near_names.h"

#include <algorithm>
#include <numeric>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr size_t kLongestName = 64;

/// Returns the distance of Damerau and Levenshtein, in which a swap of two neighbours is one edit.
/// `row[j]` is the distance of the first i letters of `a` from the first j letters of `b`.
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> before_last(b.size() + 1);
  std::vector<size_t> last(b.size() + 1);
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    before_last.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t changed = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({changed, last[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
  }
  return row.back();
}

size_t Distance(const std::string& written, const std::string& name) {
  size_t least = EditDistance(written, name);
  const std::vector<std::string> words = absl::StrSplit(name, '_');
  for (const std::string& word : words) least = std::min(least, EditDistance(written, word));
  return least;
}

}  // namespace

std::vector<std::string> NearNames(std::string_view written, std::span<const std::string> names) {
  if (written.size() > kLongestName) return {};
  const std::string lower =
      absl::AsciiStrToLower(absl::string_view(written.data(), written.size()));
  size_t least = std::max<size_t>(1, lower.size() / 3);
  std::vector<std::string> nearest;
  for (const std::string& name : names) {
    const size_t distance = Distance(lower, absl::AsciiStrToLower(name));
    if (distance > least) continue;
    if (distance < least) nearest.clear();
    least = distance;
    nearest.push_back(name);
  }
  return nearest;
}

absl::Status UnknownName(absl::string_view reason, absl::string_view kind, const std::string& name,
                         std::span<const std::string> known) {
  const std::vector<std::string> near = NearNames(name, known);
  absl::Status refusal = Refusal(
      absl::StatusCode::kInvalidArgument, reason,
      absl::StrCat("no ", kind, " is named \"", name, "\"", near.empty() ? "" : ", the nearest is ",
                   absl::StrJoin(near, " or "), "; name one of the catalogue (", known.size(),
                   " names, such as ", known.front(),
                   "; the error's metadata has all), or give the figures themselves"));
  if (!near.empty()) AddFigure(refusal, "nearest", near.front());
  AddFigure(refusal, "names", absl::StrJoin(known, ","));
  return refusal;
}

}  // namespace carillon
