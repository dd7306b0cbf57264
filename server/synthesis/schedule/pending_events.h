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
///
/// Several owners share the table. With more than one, an owner may have at most
/// kFreeMultiple times as many events in it as there are free places (Choudhury and Hahne,
/// Dynamic queue length thresholds, IEEE/ACM Trans. Networking 6, 1998). One owner alone can use
/// four fifths of the table, and if n owners fill it, 1/(4n + 1) of it stays free for the next one.
/// The places of one block, if there is a limit, are shared by the same rule.
///
/// The mixer makes a DueEvent, with its frame in the block, of each event that is collected.
class PendingEvents {
 public:
  static constexpr size_t kFreeMultiple = 4;

  /// Greatest numbers of events that wait for one block. Impulses have places of their own, so that
  /// other events, however many, leave room for them. At kNoLimit the whole table may be due in one
  /// block. Blocks that share a list share its places.
  struct BlockLimits {
    static constexpr size_t kNoLimit = SIZE_MAX;
    size_t impulses = kNoLimit;  ///< and beginnings of contacts
    size_t others = kNoLimit;    ///< forces, knots and moves
    bool limited() const { return impulses != kNoLimit || others != kNoLimit; }
  };

  PendingEvents(size_t capacity, size_t block_frame_count, size_t owner_count = 1)
      : PendingEvents(capacity, block_frame_count, owner_count, BlockLimits()) {}
  PendingEvents(size_t capacity, size_t block_frame_count, size_t owner_count,
                const BlockLimits& limits);

  /// Returns false if the table or the event's block is full, or full for this owner. The event's
  /// first sample must not lie before the end of the block that was collected last. `tag` is any
  /// number that the caller chooses; tag() returns it.
  bool TryPush(const MixerEvent& event, uint32_t tag = 0, uint32_t owner = 0) noexcept;

  bool empty() const noexcept { return waiting_count_ == 0; }

  /// Appends the indices of the events of the block that begins at `block_start`, in order of
  /// arrival. Blocks are collected in ascending order. Collected events stay readable until Free.
  /// Later events of the block's list are collected, too, if `is_stale(event, tag)` says that they
  /// will have no effect. Each list is looked at once in kListCount blocks.
  template <typename IsStale>
  void Collect(uint64_t block_start, FixedVector<uint32_t>& indices,
               const IsStale& is_stale) noexcept {
    List& list = ListOf(block_start);
    const uint64_t block_end = block_start + block_frame_count_;
    List later;
    for (uint32_t index = list.first; index != kNone;) {
      const Entry& entry = entries_[index];
      const uint32_t next = entry.next;
      if (entry.event.FirstSample() < block_end || is_stale(entry.event, entry.tag)) {
        indices.push_back(index);
      } else {
        Append(later, index);
      }
      index = next;
    }
    list = later;
  }

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
    uint32_t owner = 0;
  };
  /// A linked list of entries, in order of arrival.
  struct List {
    uint32_t first = kNone;
    uint32_t last = kNone;
  };

  /// Blocks whose numbers differ by a multiple of this share a list. They are 11 s apart at 128
  /// frames and 48 kHz.
  static constexpr size_t kListCount = 4096;

  /// Numbers of the events in a list.
  struct ListCounts {
    uint32_t impulses = 0;
    uint32_t others = 0;
  };

  size_t NumberOfList(uint64_t first_sample) const noexcept {
    return first_sample / block_frame_count_ % kListCount;
  }
  List& ListOf(uint64_t first_sample) noexcept { return lists_[NumberOfList(first_sample)]; }
  /// Returns whether an owner of `owned` events may have one more where `free` places are free.
  bool MayTakePlace(size_t owned, size_t free) const noexcept {
    return owned_counts_.size() == 1 ? free > 0 : owned < kFreeMultiple * free;
  }
  bool BlockHasPlaceFor(const MixerEvent& event, uint32_t owner) const noexcept;
  /// Adds `change`, 1 or -1, to the counts of the event's list.
  void CountInBlock(const MixerEvent& event, uint32_t owner, int change) noexcept;
  uint32_t TakeEntry() noexcept;
  void Append(List& list, uint32_t index) noexcept;

  size_t capacity_;
  size_t block_frame_count_;
  BlockLimits limits_;
  std::unique_ptr<Entry[]> entries_;
  std::vector<uint32_t> owned_counts_;  // events of each owner
  size_t waiting_count_ = 0;            // events of all owners
  uint32_t used_count_ = 0;             // entries that were ever used
  uint32_t first_free_ = kNone;
  std::vector<List> lists_;  // by block number modulo their count
  // With limits: the number of events in each list, of all owners and of each owner.
  std::vector<ListCounts> list_counts_;
  std::vector<uint16_t> list_owned_counts_;  // the owners of a list are neighbours
};

}  // namespace carillon
