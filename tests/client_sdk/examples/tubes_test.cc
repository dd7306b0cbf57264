// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/tubes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  std::vector<std::array<int, 3>> triangles;
};

Mesh ReadObj(const std::string& text) {
  Mesh mesh;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream in(line);
    std::string kind;
    in >> kind;
    if (kind == "v") {
      auto& v = mesh.vertices.emplace_back();
      in >> v[0] >> v[1] >> v[2];
    } else if (kind == "f") {
      auto& f = mesh.triangles.emplace_back();
      in >> f[0] >> f[1] >> f[2];
      for (int& i : f) --i;
    }
  }
  return mesh;
}

Mesh TubeMesh(const Tube& tube) {
  std::ostringstream out;
  WriteTubeMesh(tube, out);
  return ReadObj(out.str());
}

/// Integrates by the divergence theorem; positive where triangles are counter-clockwise from
/// outside.
double Volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.triangles) {
    const auto &a = mesh.vertices[static_cast<size_t>(f[0])],
               &b = mesh.vertices[static_cast<size_t>(f[1])],
               &c = mesh.vertices[static_cast<size_t>(f[2])];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

TEST(Tubes, EveryMeshIsClosedAndOriented) {
  for (const Tube& tube : kTubes) {
    const Mesh mesh = TubeMesh(tube);
    std::map<std::pair<int, int>, int> directed;
    for (const auto& f : mesh.triangles) {
      for (size_t i = 0; i < 3; ++i) ++directed[{f[i], f[(i + 1) % 3]}];
    }
    for (const auto& [edge, count] : directed) {
      ASSERT_EQ(count, 1) << tube.note;
      ASSERT_EQ(directed.count({edge.second, edge.first}), 1) << tube.note;
    }
    // A tube is a torus: V - E + F = 0.
    EXPECT_EQ(mesh.vertices.size() + mesh.triangles.size(), directed.size() / 2);
  }
}

TEST(Tubes, EveryMeshHasTheVolumeOfTheRoundTube) {
  const double inner = kOuterRadius_m - kWall_m;
  const double area = std::numbers::pi * (kOuterRadius_m * kOuterRadius_m - inner * inner);
  for (const Tube& tube : kTubes) {
    // The file has nine decimals: 5e-10 of 1e-3 m.
    EXPECT_NEAR(Volume(TubeMesh(tube)) / (area * tube.length_m), 1, 1e-5) << tube.note;
  }
}

TEST(Tubes, EveryMeshIsCentredAndAsLongAsItsTube) {
  for (const Tube& tube : kTubes) {
    const auto [low, high] = std::ranges::minmax(
        TubeMesh(tube).vertices, {}, [](const std::array<double, 3>& v) { return v[2]; });
    EXPECT_NEAR(low[2], -tube.length_m / 2, 1e-9);
    EXPECT_NEAR(high[2], tube.length_m / 2, 1e-9);
  }
}

}  // namespace
}  // namespace carillon::wind_chimes
