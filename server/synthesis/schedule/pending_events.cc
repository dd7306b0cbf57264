// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_events.h"

#include <cassert>

namespace carillon {

namespace {

/// Whether an event has one of the places of impulses.
bool IsImpulse(const MixerEvent& event) {
  return event.impulse() != nullptr || event.beginning() != nullptr;
}

}  // namespace

PendingEvents::PendingEvents(size_t capacity, size_t block_frame_count, size_t owner_count,
                             const BlockLimits& limits)
    : capacity_(capacity),
      block_frame_count_(block_frame_count),
      limits_(limits),
      entries_(std::make_unique_for_overwrite<Entry[]>(capacity)),
      owned_counts_(owner_count),
      lists_(kListCount),
      list_counts_(limits.limited() ? kListCount : 0),
      list_owned_counts_(list_counts_.size() * owner_count) {
  assert(capacity < kNone);
  assert(!limits.limited() || limits.impulses + limits.others <= UINT16_MAX);
}

bool PendingEvents::TryPush(const MixerEvent& event, uint32_t tag, uint32_t owner) noexcept {
  if (!MayTakePlace(owned_counts_[owner], capacity_ - waiting_count_)) return false;
  if (!BlockHasPlaceFor(event, owner)) return false;
  CountInBlock(event, owner, 1);
  const uint32_t index = TakeEntry();
  entries_[index].event = event;
  entries_[index].tag = tag;
  entries_[index].owner = owner;
  ++owned_counts_[owner];
  ++waiting_count_;
  Append(ListOf(event.FirstSample()), index);
  return true;
}

bool PendingEvents::BlockHasPlaceFor(const MixerEvent& event, uint32_t owner) const noexcept {
  if (!limits_.limited()) return true;
  const size_t number = NumberOfList(event.FirstSample());
  const ListCounts& counts = list_counts_[number];
  const size_t free = IsImpulse(event) ? limits_.impulses - counts.impulses  //
                                       : limits_.others - counts.others;
  return MayTakePlace(list_owned_counts_[number * owned_counts_.size() + owner], free);
}

void PendingEvents::CountInBlock(const MixerEvent& event, uint32_t owner, int change) noexcept {
  if (!limits_.limited()) return;
  const size_t number = NumberOfList(event.FirstSample());
  ListCounts& counts = list_counts_[number];
  (IsImpulse(event) ? counts.impulses : counts.others) += static_cast<uint32_t>(change);
  uint16_t& owned = list_owned_counts_[number * owned_counts_.size() + owner];
  owned = static_cast<uint16_t>(owned + change);
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
    CountInBlock(entries_[index].event, entries_[index].owner, -1);
    entries_[index].next = first_free_;
    first_free_ = index;
  }
  waiting_count_ -= indices.size();
}

}  // namespace carillon
