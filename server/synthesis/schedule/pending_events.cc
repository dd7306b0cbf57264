// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_events.h"

#include <cassert>

namespace carillon {
namespace {

/// Blocks whose numbers differ by a multiple of this share a list. They are 11 s apart at 128
/// frames and 48 kHz.
constexpr size_t kListCount = 4096;

}  // namespace

PendingEvents::PendingEvents(size_t capacity, size_t block_frame_count)
    : capacity_(capacity),
      block_frame_count_(block_frame_count),
      entries_(std::make_unique_for_overwrite<Entry[]>(capacity)),
      lists_(kListCount) {
  assert(capacity < kNone);
}

bool PendingEvents::TryPush(const MixerEvent& event, uint32_t tag) noexcept {
  const uint32_t index = TakeEntry();
  if (index == kNone) return false;
  entries_[index].event = event;
  entries_[index].tag = tag;
  Append(lists_[event.FirstSample() / block_frame_count_ % kListCount], index);
  return true;
}

uint32_t PendingEvents::TakeEntry() noexcept {
  if (first_free_ == kNone) {
    return used_count_ < capacity_ ? used_count_++ : kNone;
  }
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

void PendingEvents::Collect(uint64_t block_start, FixedVector<uint32_t>& indices) noexcept {
  List& list = lists_[block_start / block_frame_count_ % kListCount];
  const uint64_t block_end = block_start + block_frame_count_;
  List later;
  for (uint32_t index = list.first; index != kNone;) {
    const uint32_t next = entries_[index].next;
    if (entries_[index].event.FirstSample() < block_end) {
      indices.push_back(index);
    } else {
      Append(later, index);
    }
    index = next;
  }
  list = later;
}

void PendingEvents::Free(std::span<const uint32_t> indices) noexcept {
  for (const uint32_t index : indices) {
    entries_[index].next = first_free_;
    first_free_ = index;
  }
}

}  // namespace carillon
