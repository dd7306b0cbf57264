// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/audio_device/block_broadcast.h"
#include "server/base/mutex.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// Lets clients listen to single buses of a mixer. Safe from every thread.
class Stems {
 public:
  /// `mixer` must outlive this, and must have stopped rendering before this is destroyed.
  Stems(Mixer& mixer, const DeviceFormat& format, size_t queue_block_count)
      : mixer_(mixer), format_(format), queue_block_count_(queue_block_count) {}

  /// Adds a listener to a bus; see BlockBroadcast::Subscribe. The listener must be destroyed before
  /// this.
  absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> Subscribe(BusId bus,
                                                                      std::function<void()> wake);

  /// Hands new blocks to the listeners, and frees the stems that have no listener. The housekeeping
  /// thread calls it periodically.
  void Deliver();

  /// Returns whether anybody listens to any bus.
  bool has_listeners() const;

 private:
  class Stem final : public BusListener {
   public:
    Stem(BusId id, const DeviceFormat& format, size_t queue_block_count)
        : bus(id), broadcast(format, queue_block_count) {}

    void Hear(uint64_t first_frame, std::span<const float> block) noexcept override {
      broadcast.Publish(first_frame, block);
    }
    void End() override {
      closed = true;
      broadcast.End();
    }

    const BusId bus;
    BlockBroadcast broadcast;
    std::atomic<bool> closed{false};  ///< whether the bus was closed
    /// The mixer's frame when the bus ceased to be tapped, or zero while it is tapped.
    uint64_t left_frame = 0;
  };

  bool IsFree(Stem& stem) const;

  Mixer& mixer_;
  const DeviceFormat format_;
  const size_t queue_block_count_;
  mutable Mutex mutex_;
  std::vector<std::unique_ptr<Stem>> stems_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
