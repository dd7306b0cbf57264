// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace carillon {

/// Makes this thread treat denormal numbers as zero (FTZ and DAZ) while the object lives. Decaying
/// modes would otherwise cost up to 190 times as much. Every rendering thread has such an object.
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
