// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Largest number of rows of a page.
inline constexpr int kMaxPageSize = 1000;

/// The range of a page of rows in descending order of keys: at most `size` rows with keys less than
/// `below`.
struct PageRange {
  int64_t size = 0;
  int64_t below = 0;
};

/// Returns the token of the page that follows the row with the key `last_key`, which is positive,
/// in the list named `list`.
std::string PageToken(absl::string_view list, int64_t last_key);

/// Returns a range of the list named `list`. A `page_size` of 0 means 100. PageToken has made the
/// token, unless it is empty and asks for the newest rows. Errors: InvalidArgument
/// (INVALID_SETTINGS), also for the token of another list.
absl::StatusOr<PageRange> ParsePage(absl::string_view list, int page_size,
                                    absl::string_view page_token);

}  // namespace carillon
