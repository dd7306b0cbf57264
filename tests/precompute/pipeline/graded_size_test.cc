// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/graded_size.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "precompute/mesh/boundary.h"
#include "precompute/mesh/fill/element_size.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

class GradedBar : public testing::Test {
 protected:
  /// Sizes after a mesh in which each node has the share of the error that `error_at` returns.
  template <typename ErrorAt>
  SizeField Grade(double finer, const ErrorAt& error_at) const {
    std::vector<double> errors;
    for (const Point& p : bar_.nodes) errors.push_back(error_at(p));
    return GradedSize(bar_, errors,
                      {.element_size_m = size_m_,
                       .next_element_size_m = size_m_ * finer,
                       .dimension = 3,
                       .node_growth = std::pow(finer, -3)});
  }

  TetMesh bar_ = MakeTetBox({1, 0.2, 0.2}, {20, 4, 4}, 10);
  double size_m_ = SurfaceElementSize(BoundarySurface(bar_));
};

TEST_F(GradedBar, IsUniformWhereTheErrorIs) {
  const SizeField sizes = Grade(0.5, [](const Point&) { return 3.0; });
  EXPECT_TRUE(sizes.is_uniform());
}

TEST_F(GradedBar, HasFineElementsOnlyNearTheError) {
  const SizeField sizes = Grade(0.7, [](const Point& p) { return p[0] < 0.06 ? 1.0 : 1e-3; });
  const double near = sizes.At({0, 0.1, 0.1}), far = sizes.At({1, 0.1, 0.1});
  EXPECT_NEAR(near, 1, 0.15);  // as fine as the uniform mesh, because all of the error is there
  EXPECT_GT(far, 1.2);         // 1 / 0.7 is the size of the last mesh
  EXPECT_LE(sizes.At({0.1, 0.1, 0.1}), far);
}

TEST_F(GradedBar, IsFinerByAtMostAFactorOfFour) {
  const SizeField sizes = Grade(0.9, [](const Point& p) { return p[0] == 0 ? 1.0 : 0.0; });
  const SizeField finest = Grade(0.9, [](const Point& p) { return p[0] == 0 ? 1e9 : 1.0; });
  // Relative to 0.9 of the last size, and the sizes at the nodes differ by up to a fifth.
  EXPECT_GT(sizes.At({0, 0, 0}), 0.8 * 0.25 / 0.9);
  EXPECT_GT(finest.At({0, 0, 0}), 0.8 * 0.25 / 0.9);
}

}  // namespace
}  // namespace carillon::precompute
