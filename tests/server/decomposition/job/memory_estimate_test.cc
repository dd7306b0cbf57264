// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/memory_estimate.h"

#include <gtest/gtest.h>

#include <limits>

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

}  // namespace
}  // namespace carillon
