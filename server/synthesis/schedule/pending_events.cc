// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_events.h"

#include <cassert>

namespace carillon {

PendingEvents::PendingEvents(size_t capacity, size_t block_frame_count, size_t owner_count)
    : capacity_(capacity),
      block_frame_count_(block_frame_count),
      entries_(std::make_unique_for_overwrite<Entry[]>(capacity)),
      owned_counts_(owner_count),
      lists_(kListCount) {
  assert(capacity < kNone);
}

bool PendingEvents::TryPush(const MixerEvent& event, uint32_t tag, uint32_t owner) noexcept {
  if (!HasPlaceFor(owner)) return false;
  const uint32_t index = TakeEntry();
  entries_[index].event = event;
  entries_[index].tag = tag;
  entries_[index].owner = owner;
  ++owned_counts_[owner];
  ++waiting_count_;
  Append(ListOf(event.FirstSample()), index);
  return true;
}

bool PendingEvents::HasPlaceFor(uint32_t owner) const noexcept {
  const size_t free = capacity_ - waiting_count_;
  return owned_counts_.size() == 1 ? free > 0 : owned_counts_[owner] < kFreeMultiple * free;
}

uint32_t PendingEvents::TakeEntry() noexcept {
  if (first_free_ == kNone) return used_count_++;
  const uint32_t index = first_free_;
  first_free_ = entries_[index].next;
  return index;
}

void PendingEvents::Append(List& list, uint32_t index) noexcept {
  entries_[index].next = kNone;
  if (list.first == kNone) {
    list.first = index;
  } else {
    entries_[list.last].next = index;
  }
  list.last = index;
}

void PendingEvents::Free(std::span<const uint32_t> indices) noexcept {
  for (const uint32_t index : indices) {
    --owned_counts_[entries_[index].owner];
    entries_[index].next = first_free_;
    first_free_ = index;
  }
  waiting_count_ -= indices.size();
}

}  // namespace carillon
