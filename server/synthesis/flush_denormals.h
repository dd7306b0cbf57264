// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace carillon {

/// While it lives, this thread treats denormal numbers as zero (FTZ and DAZ): decaying modes would
/// otherwise cost up to 190 times as much. Every thread that renders holds one.
class FlushDenormals {
 public:
  FlushDenormals() noexcept;
  ~FlushDenormals();
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

 private:
  uint64_t saved_;
};

}  // namespace carillon
