// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace carillon {

/// Largest number of rows of a page.
inline constexpr int kMaxPageSize = 1000;

/// The range of a page of rows in descending order of keys: at most `size` rows with keys less than
/// `below`.
struct PageRange {
  int64_t size = 0;
  int64_t below = 0;
};

/// Returns a range. A `page_size` of 0 means 100. The token is the last key of the previous page,
/// or empty for the newest rows. Errors: InvalidArgument (INVALID_PAGE).
absl::StatusOr<PageRange> ParsePage(int page_size, const std::string& page_token);

}  // namespace carillon
