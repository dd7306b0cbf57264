// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/base/spsc_ring.h"
#include "server/synthesis/schedule/strike.h"

namespace carillon {

/// What a stream shares with the mixer: the pushing thread produces, the rendering thread consumes.
struct StrikeQueue {
  explicit StrikeQueue(size_t capacity) : ring(capacity) {}

  SpscRing<Strike> ring;
  std::atomic<bool> closed{false};
  std::atomic<uint64_t> accepted_count{0};
  std::atomic<uint64_t> late_count{0};
  std::atomic<uint64_t> dropped_count{0};
};

/// Carries the strikes of one contact stream to the mixer; one thread at a time pushes. When it is
/// destroyed, what was pushed still sounds.
class StrikeStream {
 public:
  explicit StrikeStream(std::shared_ptr<StrikeQueue> queue) : queue_(std::move(queue)) {}
  ~StrikeStream() { queue_->closed.store(true, std::memory_order_release); }
  StrikeStream(const StrikeStream&) = delete;
  StrikeStream& operator=(const StrikeStream&) = delete;

  /// False: the queue to the mixer is full and the strike is lost (counted as dropped).
  bool TryPush(const Strike& strike) noexcept {
    const bool pushed = queue_->ring.TryPush(strike);
    if (!pushed) queue_->dropped_count.fetch_add(1, std::memory_order_relaxed);
    return pushed;
  }

  /// Of this stream: strikes that the mixer took in time, took late, and that were lost. A strike
  /// counts once the mixer has taken it, at the next block or soon after.
  uint64_t accepted_count() const noexcept { return queue_->accepted_count.load(); }
  uint64_t late_count() const noexcept { return queue_->late_count.load(); }
  uint64_t dropped_count() const noexcept { return queue_->dropped_count.load(); }

 private:
  std::shared_ptr<StrikeQueue> queue_;
};

}  // namespace carillon
