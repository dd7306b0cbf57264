// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/wind_chimes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/examples/wind_chimes/tubes.h"

namespace carillon::wind_chimes {
namespace {

/// All contacts of the first seconds, as one step.
v1::ContactStep ContactsOf(uint64_t seed, double seconds) {
  const Simulation chimes = Chimes(seed);
  v1::ContactStep all;
  for (int i = 0; i < seconds / kStep_s; ++i) all.MergeFrom(chimes());
  return all;
}

TEST(WindChimes, OneSeedGivesTheSameContactsEveryTime) {
  const std::string first = ContactsOf(1, 4).SerializeAsString();
  EXPECT_EQ(first, ContactsOf(1, 4).SerializeAsString());
  EXPECT_NE(first, ContactsOf(2, 4).SerializeAsString());
}

TEST(WindChimes, EveryTubeIsStruckOnItsOuterSurface) {
  const v1::ContactStep step = ContactsOf(1, 20);
  std::set<uint32_t> struck;
  for (const v1::Contact& contact : step.contacts()) {
    ASSERT_GE(contact.object(), 1);
    ASSERT_LE(contact.object(), kTubes.size());
    struck.insert(contact.object());
    // A fraction of Bullet's margin of 1 mm.
    constexpr double kOverlap_m = 5e-4;
    const v1::Vec3& point = contact.point_m();
    EXPECT_NEAR(std::hypot(point.x(), point.y()), kOuterRadius_m, kOverlap_m);
    EXPECT_LE(std::abs(point.z()), kTubes[contact.object() - 1].length_m / 2 + 1e-4);
    // The clapper pushes inwards.
    const v1::Vec3& impulse = contact.impulse_newton_seconds();
    constexpr double kRounding = 1e-9;
    EXPECT_LT(impulse.x() * point.x() + impulse.y() * point.y(), kRounding);
    // The daemon computes how long the wooden clapper of 50 g touches.
    EXPECT_FALSE(contact.has_duration_s());
    EXPECT_EQ(contact.has_hertz(), !contact.has_second());
    if (!contact.has_hertz()) continue;
    EXPECT_EQ(contact.hertz().striker(), "wood");
    EXPECT_NEAR(contact.hertz().striker_mass_kg(), 0.05, 1e-12);
  }
  EXPECT_EQ(struck.size(), kTubes.size());
}

TEST(WindChimes, APictureHasThePosesOfAllParts) {
  const Simulation chimes = Chimes(1, Purpose::kPicture);
  v1::ContactStep step;
  for (int i = 0; i < 3 / kStep_s; ++i) step = chimes();
  std::set<uint32_t> posed;
  const v1::PoseColumns& poses = step.poses();
  for (int i = 0; i < poses.object_size(); ++i) {
    posed.insert(poses.object(i));
    if (poses.object(i) != kSailHandle) continue;
    // It hangs below the rest, and the wind has taken it aside.
    EXPECT_LT(poses.position_m(3 * i + 2), -0.5);
    EXPECT_GT(std::hypot(poses.position_m(3 * i), poses.position_m(3 * i + 1)), 0.001);
  }
  EXPECT_EQ(posed, (std::set<uint32_t>{1, 2, 3, 4, 5, 6, kClapperHandle, kSailHandle}));
}

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
