// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/phase_usage.h"

#include <gtest/gtest.h>

namespace carillon {
namespace {

using std::chrono::seconds;

v1::Progress At(v1::Phase phase, uint64_t memory_bytes) {
  v1::Progress progress;
  progress.set_phase(phase);
  progress.set_memory_bytes(memory_bytes);
  return progress;
}

TEST(PhaseUsage, TimeBelongsToThePhaseReportedBeforeIt) {
  PhaseUsage usage;
  usage.Report("a", At(v1::PHASE_MESH, 10), seconds(1));
  usage.Report("b", At(v1::PHASE_SOLVE, 70), seconds(2));
  usage.Report("a", At(v1::PHASE_SOLVE, 50), seconds(4));
  usage.End("a", seconds(9));
  usage.End("b", seconds(10));
  const PhaseUses uses = usage.uses();
  EXPECT_EQ(uses[v1::PHASE_MESH].seconds, 3);
  EXPECT_EQ(uses[v1::PHASE_SOLVE].seconds, 5 + 8);
  EXPECT_EQ(uses[v1::PHASE_MESH].peak_bytes, 10U);
  EXPECT_EQ(uses[v1::PHASE_SOLVE].peak_bytes, 70U);
}

TEST(PhaseUsage, TimeBetweenTwoRunsOfAJobBelongsToNoPhase) {
  PhaseUsage usage;
  usage.Report("a", At(v1::PHASE_MESH, 0), seconds(1));
  usage.End("a", seconds(2));
  usage.End("a", seconds(5));
  usage.Report("a", At(v1::PHASE_MESH, 0), seconds(10));
  usage.End("a", seconds(11));
  EXPECT_EQ(usage.uses()[v1::PHASE_MESH].seconds, 2);
}

}  // namespace
}  // namespace carillon
