// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/remeshed_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/precompute/radiation/spheres.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

RemeshedSurface MakeLevel(const SurfaceMesh& mesh, double edge_m) {
  RadiatingSurface body;
  body.mesh = mesh;
  body.radius_m = 1;
  Workers workers(2);
  absl::StatusOr<RemeshedSurface> level =
      MakeRemeshedSurface(body, NearestTriangle(mesh), edge_m, workers);
  EXPECT_TRUE(level.ok()) << level.status();
  return *std::move(level);
}

// Triangles of 0.3 between places on an ellipsoid cut off 3 % of its volume.
TEST(RemeshedSurface, KeepsTheVolumeOfACurvedBody) {
  SurfaceMesh mesh = MakeIcosphere(1, 5);
  for (Point& p : mesh.vertices) p = {p[0], 0.6 * p[1], 0.8 * p[2]};
  const RemeshedSurface level = MakeLevel(mesh, 0.3);
  EXPECT_LT(level.surface.vertex_count(), 300U);
  EXPECT_NEAR(EnclosedVolume(level.surface.mesh) / EnclosedVolume(mesh), 1, 0.004);
}

TEST(RemeshedSurface, LeavesAFlatBodyAsItIs) {
  const SurfaceMesh mesh = MakeBoxSurface({1, 0.6, 0.4});
  const RemeshedSurface level = MakeLevel(mesh, 0.1);
  for (const Point& p : level.surface.mesh.vertices) {
    const double inside = std::min({p[0], 1 - p[0], p[1], 0.6 - p[1], p[2], 0.4 - p[2]});
    EXPECT_LT(std::abs(inside), 0.02);
  }
}

// The rim of a bell and the edges of a bar are finer than the triangles of their coarse surfaces.
TEST(RemeshedSurface, KeepsEdgesThatAreFinerThanItsTriangles) {
  const SurfaceMesh mesh = MakeBoxSurface({1, 0.6, 0.04});
  const RemeshedSurface level = MakeLevel(mesh, 0.1);
  EXPECT_NEAR(EnclosedVolume(level.surface.mesh) / EnclosedVolume(mesh), 1, 1e-3);
}

}  // namespace
}  // namespace carillon::precompute
