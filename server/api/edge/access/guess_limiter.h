// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "server/base/clock.h"
#include "server/base/limited_log.h"
#include "server/base/mutex.h"

namespace carillon {

/// Slows the guessing of credentials. Each address may show ten wrong credentials, then one a
/// second. While an address has used up this allowance, right credentials from it are refused, too,
/// so that the answer to a guess reveals nothing. Callers that were admitted from the address
/// before are exempt. Safe from every thread.
class GuessLimiter {
 public:
  /// `clock` must outlive the limiter.
  explicit GuessLimiter(const Clock& clock) : clock_(clock) {}

  /// Returns whether the caller `name`, which showed a right credential, is admitted.
  bool TakeRight(absl::string_view peer, const std::string& name);

  /// Counts a wrong credential. Returns false if the address has shown too many, so that the caller
  /// must not learn that the credential was wrong.
  bool TakeWrong(absl::string_view peer);

 private:
  struct Source {
    Allowance wrong{10};
    std::set<std::string> known;  ///< callers that were admitted
  };

  Source& SourceOf(absl::string_view peer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock& clock_;
  Mutex mutex_;
  std::map<std::string, Source> sources_ ABSL_GUARDED_BY(mutex_);
};

inline constexpr char kLoopback[] = "loopback";

/// Returns the address of a peer such as "ipv4:192.0.2.1:4711" without its port. For an IPv6
/// address, returns the first 64 bits, because one machine may have all addresses with the same
/// first 64 bits. For each loopback address, returns kLoopback, because any process of this machine
/// may use all loopback addresses.
std::string AddressOfPeer(absl::string_view peer);

}  // namespace carillon
