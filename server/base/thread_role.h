// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/base/thread_annotations.h"

namespace carillon {

/// The role of a thread. It is modelled as a lock without cost, so that clang's thread-safety
/// analysis finds functions that the wrong kind of thread calls (lint/thread_roles).
/// ABSL_EXCLUSIVE_LOCKS_REQUIRED names the role that may call a function; ABSL_LOCKS_EXCLUDED names
/// a role that may not.
class ABSL_LOCKABLE ThreadRole {
 public:
  void Take() const ABSL_EXCLUSIVE_LOCK_FUNCTION() {}
  void Leave() const ABSL_UNLOCK_FUNCTION() {}
};

/// The role of rendering threads, which must not allocate, lock, log, throw or make system calls.
inline constexpr ThreadRole kRenderRole;

/// Gives this thread a role until the end of a scope.
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
