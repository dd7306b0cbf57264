// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/pending_strikes.h"

#include <cassert>

namespace carillon {
namespace {

/// Blocks that lie so far apart share a page: 11 s at 128 frames and 48 kHz.
constexpr size_t kPageCount = 4096;

}  // namespace

PendingStrikes::PendingStrikes(size_t capacity, size_t block_frame_count)
    : capacity_(capacity),
      block_frame_count_(block_frame_count),
      entries_(std::make_unique_for_overwrite<Entry[]>(capacity)),
      pages_(kPageCount) {
  assert(capacity < kNone);
}

bool PendingStrikes::TryPush(const PendingStrike& strike) noexcept {
  const uint32_t index = TakeEntry();
  if (index == kNone) return false;
  entries_[index].strike = strike;
  Append(pages_[strike.sample / block_frame_count_ % kPageCount], index);
  return true;
}

uint32_t PendingStrikes::TakeEntry() noexcept {
  if (first_free_ == kNone) {
    return used_count_ < capacity_ ? used_count_++ : kNone;
  }
  const uint32_t index = first_free_;
  first_free_ = entries_[index].next;
  return index;
}

void PendingStrikes::Append(Page& page, uint32_t index) noexcept {
  entries_[index].next = kNone;
  if (page.first == kNone) {
    page.first = index;
  } else {
    entries_[page.last].next = index;
  }
  page.last = index;
}

void PendingStrikes::Collect(uint64_t block_start, FixedVector<uint32_t>& indices) noexcept {
  Page& page = pages_[block_start / block_frame_count_ % kPageCount];
  const uint64_t block_end = block_start + block_frame_count_;
  Page later;
  for (uint32_t index = page.first; index != kNone;) {
    const uint32_t next = entries_[index].next;
    if (entries_[index].strike.sample < block_end) {
      indices.push_back(index);
    } else {
      Append(later, index);
    }
    index = next;
  }
  page = later;
}

void PendingStrikes::Forget(std::span<const uint32_t> indices) noexcept {
  for (const uint32_t index : indices) {
    entries_[index].next = first_free_;
    first_free_ = index;
  }
}

}  // namespace carillon
