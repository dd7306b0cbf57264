// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/join_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/read/merge_vertices.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Boxes with a region each, as a reader gives them: vertices at the same place are one.
class Boxes {
 public:
  Boxes& Add(const Point& low, const Point& size, int32_t region) {
    SurfaceMesh box;
    AddShell(box, MakeBoxSurface(size), low);
    for (size_t t = 0; t < box.triangles.size(); ++t) {
      triangles.push_back(CornersOf(box, t));
      regions.push_back(region);
    }
    return *this;
  }

  absl::StatusOr<JoinedParts> Join() const {
    return JoinParts(MergeVertices(triangles), regions, {"\"head\"", "\"handle\""});
  }

  std::vector<std::array<Point, 3>> triangles;
  std::vector<int32_t> regions;
};

/// Expects these volumes of the regions of the filled body.
void ExpectVolumes(const absl::StatusOr<JoinedParts>& joined, double first, double second) {
  ASSERT_TRUE(joined.ok()) << joined.status();
  TetMesh mesh = Tetrahedralize(joined->outside, {.target_node_count = 400}, joined->walls).value();
  NameRegions(joined->parts, mesh);
  std::vector<double> volumes(2);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* n = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const auto at = [&](size_t i) { return mesh.nodes[static_cast<size_t>(n[i])]; };
    volumes[mesh.RegionOf(e)] += TetVolume(at(0), at(1), at(2), at(3));
  }
  EXPECT_NEAR(volumes[0] / first, 1, 1e-6);
  EXPECT_NEAR(volumes[1] / second, 1, 1e-6);
}

TEST(JoinParts, BoxesWithTheSameWallAreTwoRegions) {
  const auto joined =
      Boxes().Add({0, 0, 1}, {1, 1, 1}, 0).Add({0, 0, 0}, {1, 1, 1}, 1).Join().value();
  EXPECT_EQ(joined.outside.triangles.size(), 20U);
  EXPECT_EQ(joined.walls.size(), 2U);
  ExpectVolumes(joined, 1, 1);
}

// The handle ends in the middle of a face of the head.
TEST(JoinParts, AHandleOnPartOfAFaceGetsItsTriangles) {
  ExpectVolumes(Boxes()
                    .Add({0, 0, 0.5}, {0.75, 0.25, 0.25}, 0)
                    .Add({0.25, 0.0625, 0}, {0.25, 0.125, 0.5}, 1)
                    .Join(),
                0.75 * 0.25 * 0.25, 0.25 * 0.125 * 0.5);
}

TEST(JoinParts, ARegionMayHaveTwoPieces) {
  const auto joined = Boxes()
                          .Add({0, 0, 0}, {1, 1, 0.5}, 0)
                          .Add({0, 0, 0.5}, {1, 1, 2}, 1)
                          .Add({0, 0, 2.5}, {1, 1, 0.5}, 0)
                          .Join()
                          .value();
  EXPECT_EQ(joined.parts.size(), 3U);
  ExpectVolumes(joined, 1, 2);
}

TEST(JoinParts, AFillingIsARegionOfItsOwn) {
  Boxes boxes;
  boxes.Add({0, 0, 0}, {1, 1, 1}, 0).Add({0.25, 0.25, 0.25}, {0.5, 0.5, 0.5}, 1);
  const size_t half = boxes.triangles.size() / 2;
  for (size_t t = half; t < 2 * half; ++t) {  // the wall of the cavity
    auto turned = boxes.triangles[t];
    std::swap(turned[0], turned[1]);
    boxes.triangles.push_back(turned);
    boxes.regions.push_back(0);
  }
  ExpectVolumes(boxes.Join(), 0.875, 0.125);
}

// As a modeller paints a handle and a head onto one shell: no wall divides them.
TEST(JoinParts, AWallIsPutWhereTwoRegionsShareARim) {
  Boxes boxes;
  boxes.Add({0, 0, 1}, {1, 1, 1}, 0).Add({0, 0, 0}, {1, 1, 1}, 1);
  Boxes shell;
  for (size_t t = 0; t < boxes.triangles.size(); ++t) {
    const bool is_wall =
        std::ranges::all_of(boxes.triangles[t], [](const Point& p) { return p[2] == 1; });
    if (is_wall) continue;
    shell.triangles.push_back(boxes.triangles[t]);
    shell.regions.push_back(boxes.regions[t]);
  }
  ASSERT_EQ(shell.triangles.size(), 20U);
  ExpectVolumes(shell.Join(), 1, 1);
}

TEST(JoinParts, WhatDoesNotFitTogetherIsRefused) {
  const Boxes overlap = Boxes().Add({0, 0, 0.9}, {1, 1, 1}, 0).Add({0, 0, 0}, {1, 1, 1}, 1);
  const Boxes gap = Boxes().Add({0, 0, 1.1}, {1, 1, 1}, 0).Add({0, 0, 0}, {1, 1, 1}, 1);
  const Boxes inside =
      Boxes().Add({0, 0, 0}, {1, 1, 1}, 0).Add({0.2, 0.2, 0.2}, {0.5, 0.5, 0.5}, 1);
  for (const Boxes& boxes : {overlap, gap, inside}) {
    EXPECT_THAT(boxes.Join().status().ToString(),
                HasSubstr(": the regions overlap, or leave gaps, where they are to touch: "));
  }
  Boxes open = gap;
  open.triangles.pop_back();
  open.regions.pop_back();
  EXPECT_THAT(open.Join().status().ToString(),
              HasSubstr("MESH_NOT_CLOSED: the region \"handle\": the surface has 3 open edges"));
}

}  // namespace
}  // namespace carillon::precompute
