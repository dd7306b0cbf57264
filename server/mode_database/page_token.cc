// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/page_token.h"

#include <algorithm>
#include <limits>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

absl::StatusOr<PageRange> ParsePage(int page_size, const std::string& page_token) {
  PageRange page{page_size == 0 ? 100 : std::min<int64_t>(page_size, kMaxPageSize),
                 std::numeric_limits<int64_t>::max()};
  if (page.size < 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_PAGE",
                   absl::StrCat("page_size is ", page_size, ": give zero or more"));
  }
  if (!page_token.empty() && !absl::SimpleAtoi(page_token, &page.below)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_PAGE",
                   "page_token is not one of an earlier answer: leave it empty to start anew");
  }
  return page;
}

}  // namespace carillon
