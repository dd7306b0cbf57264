// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace carillon {

/// While it lives, counts what this thread does that a rendering thread must not: malloc and its
/// kin (operator new calls them), free, and locking a mutex. Not under sanitizers, which replace
/// the same functions: see kForbiddenCallsAreSeen.
class ForbiddenCalls {
 public:
  ForbiddenCalls();
  ~ForbiddenCalls();
  ForbiddenCalls(const ForbiddenCalls&) = delete;
  ForbiddenCalls& operator=(const ForbiddenCalls&) = delete;

  size_t count() const;
};

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kForbiddenCallsAreSeen = false;
#else
inline constexpr bool kForbiddenCallsAreSeen = true;
#endif

}  // namespace carillon
