// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/base/fixed_vector.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// Events that wait for their block: a hash table from block number to the list of the block's
/// events. The time to add an event is constant, and the time to collect a block depends only on
/// the events in its list. The constructor allocates all memory.
class PendingEvents {
 public:
  PendingEvents(size_t capacity, size_t block_frame_count);

  /// Returns false if the table is full. The event's first sample must not lie before the end of
  /// the block that was collected last. tag() returns `tag`, any number of the caller's.
  bool TryPush(const MixerEvent& event, uint32_t tag = 0) noexcept;

  /// Appends the indices of the events of the block that begins at `block_start`, in order of
  /// arrival. Blocks are collected in ascending order. Collected events stay readable until Free.
  void Collect(uint64_t block_start, FixedVector<uint32_t>& indices) noexcept;

  /// Frees the memory of collected events for further events.
  void Free(std::span<const uint32_t> indices) noexcept;

  const MixerEvent& operator[](uint32_t index) const noexcept { return entries_[index].event; }
  uint32_t tag(uint32_t index) const noexcept { return entries_[index].tag; }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  struct Entry {
    MixerEvent event;
    uint32_t next = kNone;
    uint32_t tag = 0;
  };
  /// A linked list of entries, in order of arrival.
  struct List {
    uint32_t first = kNone;
    uint32_t last = kNone;
  };

  uint32_t TakeEntry() noexcept;
  void Append(List& list, uint32_t index) noexcept;

  size_t capacity_;
  size_t block_frame_count_;
  std::unique_ptr<Entry[]> entries_;
  uint32_t used_count_ = 0;  // entries that were ever used
  uint32_t first_free_ = kNone;
  std::vector<List> lists_;  // by block number modulo their count
};

}  // namespace carillon
