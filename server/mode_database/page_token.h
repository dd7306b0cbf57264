// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace carillon {

/// Most rows of a page.
inline constexpr int kMaxPageSize = 1000;

/// A page of rows in falling order of key: at most `size` keys below `below`.
struct PageRange {
  int64_t size = 0;
  int64_t below = 0;
};

/// `page_size` 0: 100; at most 1000. An empty token starts at the newest row; otherwise it is the
/// last key of the page before. Errors: InvalidArgument (INVALID_PAGE).
absl::StatusOr<PageRange> ParsePage(int page_size, const std::string& page_token);

}  // namespace carillon
