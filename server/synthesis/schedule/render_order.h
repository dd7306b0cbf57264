// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <compare>
#include <cstdint>

#include "server/synthesis/schedule/due_event.h"

namespace carillon {

/// The place of a due event in the order of rendering: by section, block and bank, then by time in
/// groups of kMergedFrames. Within a group exact events come before merged ones, then by frame,
/// then by arrival. All fields are packed into one key, the first field highest, because 64-bit
/// numbers sort fastest:
///
///     14 bits   4       15      6        1        2                22
///   | section | block | slot | group | merged | frame in group | arrival |
class RenderOrder {
 public:
  struct Fields {
    uint32_t section = 0;
    uint32_t block = 0;   ///< index among the blocks rendered together
    uint32_t slot = 0;    ///< the bank's
    uint32_t offset = 0;  ///< frames since the block's start
    bool merged = false;
    uint32_t arrival = 0;  ///< index among the events due in the blocks rendered together
  };

  static constexpr uint32_t kMostSections = 1U << 14U;
  static constexpr uint32_t kMostBlocks = 1U << 4U;
  static constexpr uint32_t kMostSlots = 1U << 15U;
  static constexpr uint32_t kMostGroups = 1U << 6U;
  static constexpr uint32_t kMostArrivals = 1U << 22U;

  RenderOrder() = default;
  explicit constexpr RenderOrder(const Fields& fields) noexcept {
    Append(fields.section, kMostSections);
    Append(fields.block, kMostBlocks);
    Append(fields.slot, kMostSlots);
    Append(fields.offset / kMergedFrames, kMostGroups);
    Append(fields.merged ? 1 : 0, 2);
    Append(fields.offset % kMergedFrames, kMergedFrames);
    Append(fields.arrival, kMostArrivals);
  }

  constexpr Fields fields() const noexcept {
    Fields fields;
    uint64_t rest = key_;
    fields.arrival = TakeLast(rest, kMostArrivals);
    fields.offset = TakeLast(rest, kMergedFrames);
    fields.merged = TakeLast(rest, 2) != 0;
    fields.offset += TakeLast(rest, kMostGroups) * kMergedFrames;
    fields.slot = TakeLast(rest, kMostSlots);
    fields.block = TakeLast(rest, kMostBlocks);
    fields.section = TakeLast(rest, kMostSections);
    return fields;
  }

  friend constexpr auto operator<=>(const RenderOrder&, const RenderOrder&) = default;

 private:
  /// `limit` is the number of values of a field. It is a power of two, so that these operations are
  /// shifts.
  constexpr void Append(uint32_t value, uint32_t limit) noexcept {
    assert(value < limit);
    key_ = key_ * limit + value;
  }
  static constexpr uint32_t TakeLast(uint64_t& rest, uint32_t limit) noexcept {
    const auto value = static_cast<uint32_t>(rest % limit);
    rest /= limit;
    return value;
  }

  uint64_t key_ = 0;
};

static_assert(uint64_t{RenderOrder::kMostSections} * RenderOrder::kMostBlocks *
                      RenderOrder::kMostSlots * RenderOrder::kMostGroups * 2 * kMergedFrames *
                      (RenderOrder::kMostArrivals / 2) ==
                  uint64_t{1} << 63U,
              "the fields fill 64 bits");

}  // namespace carillon
