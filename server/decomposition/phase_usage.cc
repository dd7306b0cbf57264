// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/phase_usage.h"

#include <algorithm>

namespace carillon {

void PhaseUsage::Report(const std::string& digest, const v1::Progress& progress,
                        std::chrono::nanoseconds now) {
  // A worker may send any number.
  const v1::Phase phase =
      v1::Phase_IsValid(progress.phase()) ? progress.phase() : v1::PHASE_UNSPECIFIED;
  const MutexLock lock(&mutex_);
  if (const auto found = running_.find(digest); found != running_.end()) Count(found->second, now);
  running_[digest] = {.phase = phase, .since = now};
  uint64_t& peak_bytes = uses_[static_cast<size_t>(phase)].peak_bytes;
  peak_bytes = std::max(peak_bytes, progress.memory_bytes());
}

void PhaseUsage::End(const std::string& digest, std::chrono::nanoseconds now) {
  const MutexLock lock(&mutex_);
  const auto found = running_.find(digest);
  if (found == running_.end()) return;
  Count(found->second, now);
  running_.erase(found);
}

PhaseUses PhaseUsage::uses() const {
  const MutexLock lock(&mutex_);
  return uses_;
}

void PhaseUsage::Count(const Running& running, std::chrono::nanoseconds now) {
  uses_[static_cast<size_t>(running.phase)].seconds +=
      std::chrono::duration<double>(now - running.since).count();
}

}  // namespace carillon
