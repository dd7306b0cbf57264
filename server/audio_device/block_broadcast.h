// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/audio_device/audio_device.h"
#include "server/audio_device/ring_buffer.h"
#include "server/base/mutex.h"

namespace carillon {

/// Some consecutive rendered frames, interleaved.
struct RenderedBlock {
  /// Number of the first since the mixer began.
  uint64_t first_frame = 0;
  std::vector<float> samples;
};

/// Gives every listener what the mixer renders. The render thread only copies into a ring
/// (Publish); another thread takes the blocks out (Deliver) into a bounded queue for each listener,
/// and one that does not read fast enough loses whole blocks.
class BlockBroadcast {
 public:
  /// At most so many listen at once.
  static constexpr size_t kMaxListenerCount = 32;

  /// One that listens. Destroy it before the broadcast, and not from within `wake`.
  class Listener {
   public:
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// The next block, or null when none waits. Any thread.
    std::shared_ptr<const RenderedBlock> TryTake();

    /// Frames lost so far.
    uint64_t lost_frame_count() const;

   private:
    friend class BlockBroadcast;
    Listener(BlockBroadcast& broadcast, std::function<void()> wake);
    void Offer(const std::shared_ptr<const RenderedBlock>& block, size_t queue_limit);

    BlockBroadcast& broadcast_;
    const std::function<void()> wake_;
    mutable Mutex mutex_;
    std::deque<std::shared_ptr<const RenderedBlock>> queue_ ABSL_GUARDED_BY(mutex_);
    uint64_t lost_frame_count_ ABSL_GUARDED_BY(mutex_) = 0;
    /// The frame that comes next when nothing is lost; unset before the first block.
    std::optional<uint64_t> next_frame_ ABSL_GUARDED_BY(mutex_);
  };

  /// Ring and queues hold `queue_block_count` blocks of `format`.
  BlockBroadcast(const DeviceFormat& format, size_t queue_block_count);

  /// Render thread: passes on a block, or, where Deliver has not kept up, leaves it out.
  void Publish(uint64_t first_frame, std::span<const float> block) noexcept;

  /// Housekeeping thread: hands out what was published since.
  void Deliver();

  /// A listener, from the next block on. `wake` is called by Deliver after blocks have come and
  /// must not block. Errors: ResourceExhausted (TOO_MANY_LISTENERS).
  absl::StatusOr<std::unique_ptr<Listener>> Subscribe(std::function<void()> wake);

 private:
  void Remove(Listener* listener);
  std::shared_ptr<const RenderedBlock> TryTakePublished();

  const DeviceFormat format_;
  const size_t queue_block_count_;
  RingBuffer<float> samples_;
  RingBuffer<uint64_t> first_frames_;
  Mutex mutex_;
  std::vector<Listener*> listeners_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
