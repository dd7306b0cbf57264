// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/tetrahedralize.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <set>

#include "precompute/mesh/fill/fill_with_tetgen.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/run_in_child.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

TetMesh Fill(const SurfaceMesh& surface, const MeshingSettings& settings) {
  absl::StatusOr<TetMesh> mesh = Tetrahedralize(surface, settings);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TetMesh{};
}

double Volume(const TetMesh& mesh) {
  double volume = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* n = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const auto at = [&](int i) { return mesh.nodes[static_cast<size_t>(n[i])]; };
    const double part = TetVolume(at(0), at(1), at(2), at(3));
    EXPECT_GT(part, 0) << "element " << e;
    volume += part;
  }
  return volume;
}

/// Each boundary face must lie on the triangle it names, and all together cover it.
void ExpectBoundaryOnGivenTriangles(const TetMesh& mesh, const SurfaceMesh& given, double size) {
  std::vector<double> uncovered;
  for (size_t t = 0; t < given.triangles.size(); ++t) {
    uncovered.push_back(Norm(AreaNormal(CornersOf(given, t))));
  }
  for (const BoundaryFace& face : mesh.boundary) {
    const auto t = static_cast<size_t>(face.given_triangle);
    ASSERT_LT(t, given.triangles.size());
    const auto plane = CornersOf(given, t);
    const Point normal = AreaNormal(plane);
    std::array<Point, 3> corner;
    for (size_t i = 0; i < 3; ++i) {
      corner[i] = mesh.nodes[static_cast<size_t>(face.nodes[i])];
      // TetGen takes points within 1e-8 of the size for points of one plane.
      EXPECT_NEAR(Dot(Difference(corner[i], plane[0]), normal) / Norm(normal), 0, 1e-8 * size);
    }
    EXPECT_GT(Dot(AreaNormal(corner), normal), 0) << "turned inward";
    uncovered[t] -= Norm(AreaNormal(corner));
  }
  const double largest = *std::ranges::max_element(uncovered);
  const double least = *std::ranges::min_element(uncovered);
  EXPECT_NEAR(largest, 0, 1e-8 * size * size);
  EXPECT_NEAR(least, 0, 1e-8 * size * size);
}

TEST(Tetrahedralize, FillsTheVolumeOfEachBody) {
  SurfaceMesh hollow = MakeSphereSurface(0.1, 3);
  AddShell(hollow, InsideOut(MakeSphereSurface(0.08, 3)));
  for (const SurfaceMesh& surface :
       {MakeBoxSurface({1, 0.05, 0.03}), InsideOut(MakeBoxSurface({1, 1, 1})), MakeTubeSurface({}),
        MakeSphereSurface(0.1, 3), hollow}) {
    const double volume = std::abs(EnclosedVolume(surface));
    EXPECT_NEAR(Volume(Fill(surface, {})), volume, 1e-6 * volume);
  }
}

TEST(Tetrahedralize, NamesTheGivenTriangleOfEachBoundaryFace) {
  const SurfaceMesh bar = MakeBoxSurface({1, 0.05, 0.03});
  ExpectBoundaryOnGivenTriangles(Fill(bar, {}), bar, 1);
  const SurfaceMesh tube = MakeTubeSurface({});
  ExpectBoundaryOnGivenTriangles(Fill(tube, {}), tube, 0.505);
}

TEST(Tetrahedralize, KeepsEveryVertexOfAKeptSurfaceAndAddsNone) {
  const SurfaceMesh sphere = MakeSphereSurface(1, 3);
  const TetMesh mesh = Fill(sphere, {.keep_surface = true, .nodes_per_element = 4});
  std::set<int32_t> on_boundary;
  for (const BoundaryFace& face : mesh.boundary) {
    on_boundary.insert(face.nodes.begin(), face.nodes.begin() + 3);
  }
  EXPECT_EQ(on_boundary.size(), sphere.vertices.size());
  EXPECT_EQ(mesh.boundary.size(), sphere.triangles.size());
}

TEST(Tetrahedralize, KeepsAFineTubeAsItIs) {
  const SurfaceMesh tube = MakeTubeSurface({});
  EXPECT_EQ(Fill(tube, {}).boundary.size(), tube.triangles.size());
}

TEST(Tetrahedralize, ComesNearTheNumberOfNodesAskedFor) {
  for (const int target : {1'000, 6'000}) {
    const TetMesh mesh =
        Fill(MakeBoxSurface({1, 0.5, 0.3}), {.target_node_count = target, .nodes_per_element = 4});
    EXPECT_NEAR(static_cast<double>(mesh.nodes.size()), target, 0.3 * target);
  }
}

TEST(Tetrahedralize, FillsFinerWhereTheFieldOfSizesIsSmall) {
  // Fine about a corner on the surface, and about a point inside that no surface makes fine.
  const Point corner{0, 0, 0}, inside{0.7, 0.5, 0.5}, far{0.3, 0.6, 0.6};
  const TetMesh mesh = Fill(MakeBoxSurface({1, 1, 1}),
                            {.element_size_m = 0.4,
                             .relative_size = SizeField({corner, inside, far}, {0.2, 0.2, 1}, 1),
                             .nodes_per_element = 4});
  const auto near = [&](const Point& place) {
    return std::ranges::count_if(mesh.nodes,
                                 [&](const Point& p) { return Distance(p, place) < 0.2; });
  };
  EXPECT_GT(near(corner), 8);
  EXPECT_GT(near(inside), 3 * std::max<std::ptrdiff_t>(near(far), 1));
}

TEST(Tetrahedralize, StaysSmallOnABarAThinPlateAndATubeOfLongNarrowStrips) {
  EXPECT_LT(Fill(MakeBoxSurface({1, 0.05, 0.03}), {}).nodes.size(), 60'000U);
  EXPECT_LT(Fill(MakeBoxSurface({1, 1, 0.001}), {}).nodes.size(), 60'000U);
  EXPECT_LT(Fill(MakeTubeSurface({.around = 64, .along = 1}), {}).nodes.size(), 60'000U);
}

TEST(Tetrahedralize, DoesNotDependOnSizeOrPlace) {
  const TetMesh metres = Fill(MakeBoxSurface({1, 0.5, 0.25}), {});
  SurfaceMesh far_away;
  AddShell(far_away, MakeBoxSurface({1.0 / 1024, 0.5 / 1024, 0.25 / 1024}), {1, 2, 4});
  const TetMesh small = Fill(far_away, {});
  ASSERT_EQ(small.elements, metres.elements);
  for (size_t n = 0; n < small.nodes.size(); ++n) {
    EXPECT_NEAR((small.nodes[n][0] - 1) * 1024, metres.nodes[n][0], 1e-9);  // rounding at 1 m
  }
}

TEST(Tetrahedralize, TurnsACrashOfTheMesherIntoARefusal) {
  // Two boxes through each other; CheckSurface would not let them pass.
  SurfaceMesh crossing = MakeBoxSurface({1, 1, 1});
  AddShell(crossing, MakeBoxSurface({1, 1, 1}), {0.5, 0.25, 0.125});
  EXPECT_THAT(Tetrahedralize(crossing, {}).status().ToString(),
              HasSubstr("MESH_TETRAHEDRALIZATION_FAILED"));
}

TEST(Tetrahedralize, RefusesAMeshOverTheLimit) {
  EXPECT_THAT(Tetrahedralize(MakeBoxSurface({1, 1, 1}), {.target_node_count = 100'000'000})
                  .status()
                  .ToString(),
              HasSubstr("MESH_TOO_LARGE"));
}

TEST(FillWithTetgen, IsStoppedWhereItRefinesLongerThanItMay) {
  const RefinedSurface box = RefineSurface(MakeBoxSurface({1, 1, 1}), 1);
  const SizeField uniform;
  const auto mesh = FillWithTetgen({.surface = box,
                                    .cavities = {},
                                    .max_volume = 1e-8,  // 10^8 tetrahedra take an hour
                                    .relative_size = uniform,
                                    .keep_surface = false,
                                    .max_added_nodes = 100'000'000,
                                    .most_cpu = std::chrono::seconds(1)});
  EXPECT_THAT(mesh.status().ToString(), HasSubstr("stopped after 1 s"));
}

constexpr std::chrono::seconds kMostCpu(10);

TEST(RunInChild, StopsAChildThatDoesNotEnd) {
  const auto run_on = []() -> std::string {
    for (volatile bool on = true; on;) {
    }
    return "ended";
  };
  EXPECT_THAT(RunInChild(run_on, std::chrono::seconds(1)).status().ToString(),
              HasSubstr("stopped after 1 s"));
}

TEST(RunInChild, ReturnsTheBytesOfTheChild) {
  std::string bytes(3'000'000, 'x');
  EXPECT_EQ(RunInChild([&] { return bytes; }, kMostCpu).value(), bytes);
}

TEST(RunInChild, SurvivesAndTellsHowTheChildEnded) {
  EXPECT_THAT(RunInChild([]() -> std::string { std::abort(); }, kMostCpu).status().ToString(),
              HasSubstr("signal 6"));
  EXPECT_THAT(RunInChild([]() -> std::string { _Exit(3); }, kMostCpu).status().ToString(),
              HasSubstr("status 3"));
}

}  // namespace
}  // namespace carillon::precompute
