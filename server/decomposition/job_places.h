// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "carillon/v1/decomposition.pb.h"

namespace carillon {

/// The limits of the jobs that may run at a time; see the functions of Executor with the same
/// names.
struct JobCapacity {
  int worker_count = 0;
  uint64_t memory_budget_bytes = 0;
  bool transfers_yield = false;
};

/// The workers and the memory that running jobs occupy. A job that does not fit into the memory at
/// all runs alone.
///
/// If transfers yield, a decomposition needs one of the workers that no other decomposition
/// occupies. A transfer needs a worker that no job occupies, but one transfer runs even without it.
/// If transfers do not yield, all jobs are equal here. Only one thread at a time may use an object.
class JobPlaces {
 public:
  void SetCapacity(const JobCapacity& capacity) { capacity_ = capacity; }

  /// Returns what keeps a job that needs `bytes` from starting; WAIT_CAUSE_UNSPECIFIED if nothing
  /// does.
  v1::WaitCause Obstacle(v1::JobKind kind, uint64_t bytes) const;

  void Take(const std::string& digest, v1::JobKind kind, uint64_t bytes);
  /// Changes the memory that a running job occupies.
  void Resize(const std::string& digest, uint64_t bytes) { runs_.at(digest).bytes = bytes; }
  void Free(const std::string& digest) { runs_.erase(digest); }

  /// Chooses the transfers to end, youngest first, so that a decomposition that needs `bytes` can
  /// start. The list is empty if ending all transfers would not free enough memory, or if no more
  /// transfers than those chosen earlier need to end.
  std::vector<std::string> ChooseToEnd(uint64_t bytes);

  /// Returns the running jobs that occupy what a waiting job of `kind` needs.
  std::vector<std::string> Occupants(v1::JobKind kind, v1::WaitCause cause) const;

 private:
  struct Run {
    v1::JobKind kind = v1::JOB_KIND_UNSPECIFIED;
    uint64_t bytes = 0;
    uint64_t number = 0;  ///< order of the starts
    bool ends = false;    ///< ChooseToEnd has returned it
  };

  size_t CountOf(v1::JobKind kind) const;
  bool LacksWorker(v1::JobKind kind) const;
  uint64_t OccupiedBytes() const;

  JobCapacity capacity_;
  std::map<std::string, Run> runs_;  ///< by digest
  uint64_t last_number_ = 0;
};

}  // namespace carillon
