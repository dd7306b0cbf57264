// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/strike.h"

namespace carillon {

/// A strike waiting for the sample at which it is first heard.
struct PendingStrike {
  uint64_t sample = 0;
  uint64_t arrival = 0;   ///< breaks ties, so that the order never depends on the heap
  float lead_frames = 0;  ///< from the strike to that sample
  BankId bank{};
  StrikeKind kind = StrikeKind::kImpulse;
  Excitation excitation{};
  ForceKnot knot{};
};

/// Strikes ordered by sample, then by arrival. All memory is taken when it is made.
class PendingStrikes {
 public:
  explicit PendingStrikes(size_t capacity) : capacity_(capacity) { heap_.reserve(capacity); }

  /// False: full.
  bool TryPush(PendingStrike strike) noexcept {
    if (heap_.size() == capacity_) return false;
    strike.arrival = ++arrival_count_;
    heap_.push_back(strike);
    std::push_heap(heap_.begin(), heap_.end(), Later);
    return true;
  }

  bool empty() const noexcept { return heap_.empty(); }

  /// The first of those that wait; there is one.
  const PendingStrike& front() const noexcept { return heap_.front(); }

  void PopFront() noexcept {
    std::pop_heap(heap_.begin(), heap_.end(), Later);
    heap_.pop_back();
  }

 private:
  static bool Later(const PendingStrike& a, const PendingStrike& b) noexcept {
    return a.sample != b.sample ? a.sample > b.sample : a.arrival > b.arrival;
  }

  size_t capacity_;
  uint64_t arrival_count_ = 0;
  std::vector<PendingStrike> heap_;
};

}  // namespace carillon
