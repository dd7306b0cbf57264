// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/base/thread_annotations.h"

namespace carillon {

/// What a thread is there for, as a lock that costs nothing: clang's thread-safety analysis then
/// finds a function called by the wrong kind of thread (lint/thread_roles).
/// ABSL_EXCLUSIVE_LOCKS_REQUIRED says which role a function belongs to, ABSL_LOCKS_EXCLUDED which
/// may not call it.
class ABSL_LOCKABLE ThreadRole {
 public:
  void Take() const ABSL_EXCLUSIVE_LOCK_FUNCTION() {}
  void Leave() const ABSL_UNLOCK_FUNCTION() {}
};

/// Renders: it neither allocates, locks, logs, throws nor calls the system.
inline constexpr ThreadRole kRenderRole;

/// This thread has a role for the length of a scope.
class ABSL_SCOPED_LOCKABLE InRole {
 public:
  explicit InRole(const ThreadRole& role) ABSL_EXCLUSIVE_LOCK_FUNCTION(role) : role_(role) {
    role_.Take();
  }
  InRole(const InRole&) = delete;
  InRole& operator=(const InRole&) = delete;
  ~InRole() ABSL_UNLOCK_FUNCTION() { role_.Leave(); }

 private:
  const ThreadRole& role_;
};

}  // namespace carillon
