// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "server/api/limited_log.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"

namespace carillon {

/// Slows the guessing of credentials: each address may show ten wrong ones, then one a second.
/// Meanwhile right ones are refused there, too, so that a guess learns nothing, except those of
/// callers that were let in from the address before. Safe from every thread.
class GuessLimiter {
 public:
  /// `clock` must outlive the limiter.
  explicit GuessLimiter(const Clock& clock) : clock_(clock) {}

  /// Returns whether the caller `name`, which showed a right credential, may come in.
  bool TakeRight(absl::string_view peer, const std::string& name);

  /// Counts a wrong credential. Returns whether the caller may learn that it was wrong; false if
  /// the caller has shown too many.
  bool TakeWrong(absl::string_view peer);

 private:
  struct Source {
    Allowance wrong{10};
    std::set<std::string> known;  ///< callers that were let in
  };

  Source& SourceOf(absl::string_view peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  Mutex mutex_;
  std::map<std::string, Source> sources_ ABSL_GUARDED_BY(mutex_);
};

/// The address of a peer such as "ipv4:192.0.2.1:4711" without its port; of an IPv6 address the
/// first 64 bits, because one machine may have all the rest.
std::string AddressOfPeer(absl::string_view peer);

}  // namespace carillon
