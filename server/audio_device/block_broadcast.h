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
#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "server/audio_device/audio_device.h"
#include "server/audio_device/ring_buffer.h"
#include "server/base/mutex.h"

namespace carillon {

/// Some consecutive rendered frames, interleaved.
struct RenderedBlock {
  /// Number of the first frame, counted from the mixer's start.
  uint64_t first_frame = 0;
  std::vector<float> samples;
};

/// Delivers every rendered block to every listener. The render thread only copies blocks into a
/// ring buffer (Publish). Another thread moves them to a bounded queue for each listener (Deliver).
/// A listener that does not read fast enough loses whole blocks.
class BlockBroadcast {
 public:
  /// Greatest number of listeners at a time.
  static constexpr size_t kMaxListenerCount = 32;

  /// A listener. It must be destroyed before the broadcast, and not by its own `wake`.
  class Listener {
   public:
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Returns the next block, or null if no block waits. Any thread may call it.
    std::shared_ptr<const RenderedBlock> TryTake();

    /// Returns whether the broadcast has ended. Blocks that were queued before may still wait.
    bool ended() const;

    /// Number of frames lost so far.
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
    bool ended_ ABSL_GUARDED_BY(mutex_) = false;
    /// First frame of the next block if no block is lost. Unset before the first block.
    std::optional<uint64_t> next_frame_ ABSL_GUARDED_BY(mutex_);
  };

  /// The ring buffer and each queue hold `queue_block_count` blocks of `format`.
  BlockBroadcast(const DeviceFormat& format, size_t queue_block_count);

  /// Copies a block into the ring buffer, or drops it if Deliver has not kept up. The render thread
  /// calls it.
  void Publish(uint64_t first_frame, std::span<const float> block) noexcept;

  /// Hands the newly published blocks to the listeners, and calls `observe` with each block.
  /// `observe` must not use the broadcast. The housekeeping thread calls it.
  void Deliver(absl::FunctionRef<void(const RenderedBlock&)> observe = [](const RenderedBlock&) {});

  /// Adds a listener, which gets all blocks from the next one on. Deliver calls `wake` after it has
  /// queued blocks. `wake` must not block. Errors: ResourceExhausted (TOO_MANY_CALLS).
  absl::StatusOr<std::unique_ptr<Listener>> Subscribe(std::function<void()> wake);

  /// Tells the listeners that no further block will come.
  void End();

  size_t listener_count() const;

 private:
  void Remove(Listener* listener);
  std::shared_ptr<const RenderedBlock> TryTakePublished();

  const DeviceFormat format_;
  const size_t queue_block_count_;
  RingBuffer<float> samples_;
  RingBuffer<uint64_t> first_frames_;
  mutable Mutex mutex_;
  std::vector<Listener*> listeners_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
