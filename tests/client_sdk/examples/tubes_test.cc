// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/tubes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace carillon::wind_chimes {
namespace {

struct Mesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<size_t, 3>> triangles;
};

Mesh TubeMesh(const Tube& tube) {
  std::stringstream lines;
  WriteTubeMesh(tube, lines);
  std::string comment;
  std::getline(lines, comment);
  Mesh mesh;
  char kind = 0;
  std::array<double, 3> x{};
  while (lines >> kind >> x[0] >> x[1] >> x[2]) {
    if (kind == 'v') {
      mesh.vertices.push_back(x);
    } else {
      auto& corners = mesh.triangles.emplace_back();
      for (size_t i = 0; i < 3; ++i) corners[i] = static_cast<size_t>(x[i]) - 1;
    }
  }
  EXPECT_TRUE(lines.eof());
  return mesh;
}

/// Integrates by the divergence theorem; positive where triangles are counter-clockwise from
/// outside.
double Volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.triangles) {
    const auto &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

TEST(Tubes, EveryMeshIsClosedAndOrientedAndHasTheSizeOfTheRoundTube) {
  const double inner = kOuterRadius_m - kWall_m;
  const double area = std::numbers::pi * (kOuterRadius_m * kOuterRadius_m - inner * inner);
  for (const Tube& tube : kTubes) {
    SCOPED_TRACE(tube.note);
    const Mesh mesh = TubeMesh(tube);
    std::map<std::pair<size_t, size_t>, int> directed;
    for (const auto& f : mesh.triangles) {
      for (size_t i = 0; i < 3; ++i) ++directed[{f[i], f[(i + 1) % 3]}];
    }
    for (const auto& [edge, count] : directed) {
      ASSERT_EQ(count, 1);
      ASSERT_TRUE(directed.contains({edge.second, edge.first}));
    }
    // A tube is a torus: V - E + F = 0.
    EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size(), directed.size() / 2);
    // The file has nine decimals: 5e-10 of 1e-3 m.
    EXPECT_NEAR(Volume(mesh) / (area * tube.length_m), 1, 1e-5);
    const auto [low, high] =
        std::ranges::minmax(mesh.vertices, {}, [](const std::array<double, 3>& v) { return v[2]; });
    EXPECT_NEAR(low[2], -tube.length_m / 2, 1e-9);
    EXPECT_NEAR(high[2], tube.length_m / 2, 1e-9);
  }
}

}  // namespace
}  // namespace carillon::wind_chimes
