// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/lane_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr size_t kBlockFrames = 128;

/// Modes of all decays from 20 ms to 60 s, the frequencies of which go up.
LanePlan PlanOfManyDecays(uint32_t mode_count) {
  SoundingModes sounding;
  for (uint32_t column = 0; column < mode_count; ++column) {
    const double t60_s = 0.02 * std::pow(3000.0, std::fmod(column * 0.618, 1.0));
    sounding.modes.push_back(MakeMode(column, 100 + 20.0 * column, -std::log(1000.0) / t60_s));
  }
  return PlanLanes(
      sounding, MakeUniformShapes(mode_count),
      {.sample_rate_hz = kTestSampleRateHz, .block_frame_count = kBlockFrames, .gain = 1});
}

TEST(LanePlan, EveryModeHasOneLane) {
  const LanePlan plan = PlanOfManyDecays(800);
  std::vector<uint32_t> columns;
  for (const auto& part : plan.lanes) {
    for (const PlannedLane& lane : part) columns.push_back(lane.column);
  }
  std::ranges::sort(columns);
  std::vector<uint32_t> all(800);
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(columns, all);
}

TEST(LanePlan, TheLongPartsOfALargeBankAreWholeVectors) {
  const LanePlan plan = PlanOfManyDecays(800);
  for (size_t part = 2; part < plan.lanes.size(); ++part) {
    ASSERT_FALSE(plan.lanes[part].empty());
    EXPECT_EQ(plan.lanes[part].size() % kMostLanes, 0U) << "part " << part;
  }
}

TEST(LanePlan, ASmallBankRingsInTheLongestBlocksThatItsDecaysAllow) {
  const LanePlan plan = PlanOfManyDecays(30);
  for (size_t part = 0; part < plan.lanes.size(); ++part) {
    for (const PlannedLane& lane : plan.lanes[part]) {
      const std::optional<size_t> kind = ChooseLongBlock(lane.log_q, kBlockFrames);
      EXPECT_EQ(kind ? *kind + 1 : 0, part) << "column " << lane.column;
    }
  }
}

/// Which keeps their accuracy, see ChooseLongBlock.
TEST(LanePlan, NoModeRingsInLongerBlocksThanItsDecayAllows) {
  const LanePlan plan = PlanOfManyDecays(800);
  for (size_t part = 1; part < plan.lanes.size(); ++part) {
    for (const PlannedLane& lane : plan.lanes[part]) {
      EXPECT_LE(part, ChooseLongBlock(lane.log_q, kBlockFrames).value() + 1);
    }
  }
}

TEST(LanePlan, EveryLaneIsTiledOnceAndNoneInATileTooLongForIt) {
  const LanePlan plan = PlanOfManyDecays(800);
  std::array<size_t, kTileKinds> counts{};
  for (size_t part = 0; part < plan.lanes.size(); ++part) {
    size_t end = 0;
    for (const size_t kind : kTileOrder) {
      const LaneRange tiled = plan.Tiled(part, kind);
      EXPECT_EQ(tiled.first, end);
      EXPECT_EQ(tiled.count % kMostLanes, 0U);
      end += tiled.count;
      counts[kind] += tiled.count;
      for (size_t i = tiled.first; i < std::min(end, plan.lanes[part].size()); ++i) {
        EXPECT_GE(ChooseTile(plan.lanes[part][i].log_q), kind);
      }
    }
    EXPECT_EQ(end, plan.PaddedCount(part));
  }
  for (const size_t count : counts) EXPECT_GT(count, 0U);
}

}  // namespace
}  // namespace carillon
