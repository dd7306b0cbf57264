// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/page_token.h"

#include <algorithm>
#include <limits>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

std::string PageToken(absl::string_view list, int64_t last_key) {
  return absl::StrCat(list, "-", last_key);
}

absl::StatusOr<PageRange> ParsePage(absl::string_view list, int page_size,
                                    absl::string_view page_token) {
  PageRange page{page_size == 0 ? 100 : std::min<int64_t>(page_size, kMaxPageSize),
                 std::numeric_limits<int64_t>::max()};
  if (page.size < 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("page_size is ", page_size, ": give zero or more"));
  }
  if (page_token.empty()) return page;
  // The key is written again and compared, because SimpleAtoi also reads "+1" and " 1".
  const absl::string_view key = absl::StripPrefix(page_token, absl::StrCat(list, "-"));
  if (absl::SimpleAtoi(key, &page.below) && page.below > 0 &&
      page_token == PageToken(list, page.below)) {
    return page;
  }
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("page_token is not one of an earlier answer that listed ", list,
                              ": leave it empty to start anew"));
}

}  // namespace carillon
