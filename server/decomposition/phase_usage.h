// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "carillon/v1/decomposition.pb.h"
#include "server/base/mutex.h"

namespace carillon {

/// The cost of one phase in all jobs since the daemon started.
struct PhaseUse {
  double seconds = 0;
  uint64_t peak_bytes = 0;  ///< largest memory of one worker within the phase; 0 if unknown
};

using PhaseUses = std::array<PhaseUse, v1::Phase_ARRAYSIZE>;

/// Adds up the time and the memory of each phase, from the progress that workers report. Safe from
/// every thread.
class PhaseUsage {
 public:
  /// Notes that the job `digest` reports progress at `now`. The time since its last report counts
  /// for the phase of that report.
  void Report(const std::string& digest, const v1::Progress& progress,
              std::chrono::nanoseconds now);

  /// Notes that the run of the job has ended.
  void End(const std::string& digest, std::chrono::nanoseconds now);

  /// Returns the costs by the number of the phase.
  PhaseUses uses() const;

 private:
  struct Running {
    v1::Phase phase = v1::PHASE_UNSPECIFIED;
    std::chrono::nanoseconds since{};
  };

  void Count(const Running& running, std::chrono::nanoseconds now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  mutable Mutex mutex_;
  PhaseUses uses_ ABSL_GUARDED_BY(mutex_){};
  std::map<std::string, Running> running_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
