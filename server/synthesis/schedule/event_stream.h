// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/base/spsc_queue.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// What an event stream carries.
enum class StreamKind {
  kTimely,  ///< contacts; impulses that come too late are counted as late
  kAtOnce,  ///< contacts that sound when they come; late impulses count as accepted
  kMoves,   ///< moves alone, which need not be rendered as long as nothing sounds
};

/// The part of an event stream that the mixer shares: the pushing thread produces events, the
/// rendering thread consumes them.
struct EventQueue {
  explicit EventQueue(size_t capacity, StreamKind stream_kind = StreamKind::kTimely)
      : events(capacity), kind(stream_kind) {}

  SpscQueue<MixerEvent> events;
  const StreamKind kind;
  std::atomic<bool> closed{false};
  std::atomic<uint64_t> accepted_count{0};
  std::atomic<uint64_t> late_count{0};
  std::atomic<uint64_t> dropped_count{0};
};

/// Carries events of one source, a contact stream for instance, to the mixer; one thread at a time
/// pushes. Events pushed before the stream is destroyed are still rendered.
class EventStream {
 public:
  explicit EventStream(std::shared_ptr<EventQueue> queue) : queue_(std::move(queue)) {}
  ~EventStream() { queue_->closed.store(true, std::memory_order_release); }
  EventStream(const EventStream&) = delete;
  EventStream& operator=(const EventStream&) = delete;

  /// Returns false if the queue to the mixer is full. The event is then lost, and counted as
  /// dropped.
  bool TryPush(const MixerEvent& event) noexcept {
    const bool pushed = queue_->events.TryPush(event);
    if (!pushed) {
      queue_->dropped_count.fetch_add(event.ReportCount(), std::memory_order_relaxed);
    }
    return pushed;
  }

  /// Returns the number of events that can be pushed before the mixer takes some.
  size_t room() const noexcept { return queue_->events.room(); }

  /// These three functions return the numbers of impulses of this stream that the mixer took in
  /// time, of those that it took late, and of events that were lost because the queue, the mixer or
  /// the event's block was full, or because the bank had gone. An event is counted once the mixer
  /// has taken it, which happens at the next block or soon after.
  uint64_t accepted_count() const noexcept { return queue_->accepted_count.load(); }
  uint64_t late_count() const noexcept { return queue_->late_count.load(); }
  uint64_t dropped_count() const noexcept { return queue_->dropped_count.load(); }

 private:
  std::shared_ptr<EventQueue> queue_;
};

}  // namespace carillon
