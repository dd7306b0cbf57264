// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/base/fixed_vector.h"
#include "server/synthesis/schedule/strike.h"

namespace carillon {

/// A strike waiting for the sample at which it is first heard.
struct PendingStrike {
  uint64_t sample = 0;
  float lead_frames = 0;  ///< from the strike to that sample
  BankId bank{};
  StrikeKind kind = StrikeKind::kImpulse;
  Excitation excitation{};
  ForceKnot knot{};
};

/// A calendar of strikes, a page a block. Neither adding one nor collecting a block's depends on
/// how many wait. All memory is taken when it is made.
class PendingStrikes {
 public:
  PendingStrikes(size_t capacity, size_t block_frame_count);

  /// False: full. The sample does not lie before the block that was collected last.
  bool TryPush(const PendingStrike& strike) noexcept;

  /// The strikes of the block that begins at `block_start`, in order of arrival, by index; what was
  /// collected before is forgotten. Blocks are collected in turn; with several before Forget,
  /// their strikes stay.
  void Collect(uint64_t block_start, FixedVector<uint32_t>& indices) noexcept;

  /// Frees the places of collected strikes.
  void Forget(std::span<const uint32_t> indices) noexcept;

  const PendingStrike& operator[](uint32_t index) const noexcept { return entries_[index].strike; }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;
  struct Entry {
    PendingStrike strike;
    uint32_t next = kNone;
  };
  /// A list, in order of arrival.
  struct Page {
    uint32_t first = kNone;
    uint32_t last = kNone;
  };

  uint32_t TakeEntry() noexcept;
  void Append(Page& page, uint32_t index) noexcept;

  size_t capacity_;
  size_t block_frame_count_;
  std::unique_ptr<Entry[]> entries_;
  uint32_t used_count_ = 0;  // entries that were ever used
  uint32_t first_free_ = kNone;
  std::vector<Page> pages_;
};

}  // namespace carillon
