// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "server/base/mutex.h"

namespace carillon {

/// Counts rejected contacts by reason. Safe from every thread.
class RejectionCounts {
 public:
  void Add(uint64_t count, const absl::Status& why) {
    const std::string reason(why.message().substr(0, why.message().find(':')));
    const MutexLock lock(&mutex_);
    counts_[reason] += count;
  }

  std::map<std::string, uint64_t> counts() const {
    const MutexLock lock(&mutex_);
    return counts_;
  }

 private:
  mutable Mutex mutex_;
  std::map<std::string, uint64_t> counts_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
