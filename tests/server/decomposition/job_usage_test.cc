// SPDX-License-Identifier: Apache-2.0
//
// What memory jobs are estimated to take, and what time and memory their phases take.
#include <gtest/gtest.h>

#include <limits>

#include "server/decomposition/job/memory_estimate.h"
#include "server/decomposition/phase_usage.h"

namespace carillon {
namespace {

TEST(MemoryEstimate, GrowsAsTheFactorOfASolidDoes) {
  // Eight times the nodes of a solid fill in sixteen times the factor.
  EXPECT_NEAR(static_cast<double>(MemoryOfNodes(8e6)) / static_cast<double>(MemoryOfNodes(1e6)), 16,
              0.1);
}

TEST(MemoryEstimate, FollowsWhatIsAskedForElseTheMeshFile) {
  v1::CreateModalModelRequest request;
  request.set_mesh_format("stl");
  request.mutable_settings()->set_element(v1::ELEMENT_LINEAR);
  EXPECT_GT(GuessNodeCount(request, 10'000'000), 10 * GuessNodeCount(request, 100'000));
  request.mutable_settings()->mutable_mesh()->set_target_node_count(5000);
  EXPECT_EQ(GuessNodeCount(request, 10'000'000), 5000);
}

TEST(MemoryEstimate, ComesToWhatIsSeen) {
  MemoryExperience experience;
  for (int i = 0; i < 100; ++i) experience.Learn(1000, 3000);
  EXPECT_NEAR(static_cast<double>(experience.Corrected(1000)), 3000, 10);
  EXPECT_EQ(MemoryExperience(experience.correction()).Corrected(1000), experience.Corrected(1000));
  EXPECT_EQ(MemoryExperience(std::numeric_limits<double>::quiet_NaN()).correction(), 1);
}

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
