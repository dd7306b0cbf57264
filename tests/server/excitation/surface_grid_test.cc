// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "server/excitation/closest_point.h"
#include "server/excitation/surface_locator.h"
#include "tests/server/excitation/meshes.h"

namespace carillon {
namespace {

/// Two sides of `count` x `count` squares, `thickness` apart.
Mesh Plate(uint32_t count, double thickness) {
  Mesh mesh;
  for (uint32_t side = 0; side < 2; ++side) {
    const uint32_t begin = side * (count + 1) * (count + 1);
    for (uint32_t i = 0; i <= count; ++i) {
      for (uint32_t k = 0; k <= count; ++k) {
        mesh.vertices.push_back(ToVertex(0.01 * i, 0.01 * k, side * thickness));
      }
    }
    for (uint32_t i = 0; i < count; ++i) {
      for (uint32_t k = 0; k < count; ++k) {
        const uint32_t a = begin + i * (count + 1) + k, b = a + count + 1;
        mesh.triangles.push_back({a, b, a + 1});
        mesh.triangles.push_back({b, b + 1, a + 1});
      }
    }
  }
  return mesh;
}

/// Long triangles that cross the whole body, 10,000 times as long as wide.
Mesh Slivers(std::mt19937& random) {
  std::uniform_real_distribution<double> anywhere(-1, 1);
  Mesh mesh;
  for (uint32_t i = 0; i < 200; ++i) {
    const double x = anywhere(random), y = anywhere(random), z = anywhere(random);
    mesh.vertices.push_back(ToVertex(x, y, z));
    mesh.vertices.push_back(ToVertex(-x, -y, anywhere(random)));
    mesh.vertices.push_back(ToVertex(x + 1e-4, y, z + 1e-4));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

/// A cone whose tip has `count` triangles, and a bottom of as many.
Mesh Cone(uint32_t count) {
  Mesh mesh{.vertices = {{0, 0, 0.2F}, {0, 0, 0}}, .triangles = {}};
  for (uint32_t i = 0; i < count; ++i) {
    const double around = 2 * M_PI * i / count;
    mesh.vertices.push_back(ToVertex(0.1 * std::cos(around), 0.1 * std::sin(around), 0));
    mesh.triangles.push_back({0, 2 + i, 2 + (i + 1) % count});
    mesh.triangles.push_back({1, 2 + (i + 1) % count, 2 + i});
  }
  return mesh;
}

/// Triangles anywhere, some of them dots or lines, and each of them twice.
Mesh Soup(std::mt19937& random) {
  std::uniform_real_distribution<double> anywhere(-0.5, 0.5);
  std::uniform_int_distribution<uint32_t> any(0, 99);
  Mesh mesh;
  for (uint32_t i = 0; i < 100; ++i) {
    mesh.vertices.push_back(ToVertex(anywhere(random), anywhere(random), anywhere(random)));
  }
  for (uint32_t i = 0; i < 300; ++i) {
    mesh.triangles.push_back({any(random), any(random), any(random)});
    mesh.triangles.push_back(mesh.triangles.back());
  }
  return mesh;
}

/// Far from even: a fine sphere beside a box a thousand times as large.
Mesh Uneven() {
  Mesh mesh = MakeSphere(0.1, 20, 20);
  mesh.Add(MakeBox(100, 80, 90));
  return mesh;
}

/// A sphere as a scanner might see it.
Mesh NoisySphere(std::mt19937& random) {
  Mesh mesh = MakeSphere(0.1, 60, 60);
  std::normal_distribution<float> noise(0, 1e-3F);
  for (Vertex& vertex : mesh.vertices) {
    for (float& x : vertex) x += noise(random);
  }
  return mesh;
}

std::map<std::string, Mesh> Meshes() {
  std::mt19937 random(7);
  return {{"sphere", MakeSphere(0.1, 40, 40)},
          {"box", MakeBox(0.1, 0.2, 0.3)},
          {"bar", MakeBox(0.2, 0.016, 0.0101)},
          {"foil", Plate(20, 1e-5)},
          {"one side", Plate(20, 0)},
          {"slivers", Slivers(random)},
          {"cone", Cone(1000)},
          {"soup", Soup(random)},
          {"uneven", Uneven()},
          {"noisy sphere", NoisySphere(random)}};
}

std::array<Point, 3> Corners(const Mesh& mesh, uint32_t t) {
  const Triangle& triangle = mesh.triangles[t];
  return {mesh.At(triangle, {1, 0, 0}), mesh.At(triangle, {0, 1, 0}), mesh.At(triangle, {0, 0, 1})};
}

/// A locator of a surface that is its own given one. Both arguments must outlive it.
std::unique_ptr<SurfaceLocator> LocatorOf(const Mesh& mesh, const std::vector<uint32_t>& given) {
  return SurfaceLocator::Make({mesh.vertices, mesh.triangles, given, mesh.vertices, mesh.triangles})
      .value();
}

/// A point of a random triangle: its inside, an edge, a corner, or one in single precision.
Point OnSurface(const Mesh& mesh, std::mt19937& random) {
  std::uniform_int_distribution<uint32_t> any(0, static_cast<uint32_t>(mesh.triangles.size()) - 1);
  std::uniform_real_distribution<double> share(0, 1);
  const Triangle& triangle = mesh.triangles[any(random)];
  const uint32_t kind = any(random) % 4;
  const double v = kind == 2 ? 0 : share(random), w = kind > 0 ? 0 : share(random) * (1 - v);
  Point point = mesh.At(triangle, {1 - v - w, v, w});
  for (double& x : point) x = kind == 3 ? static_cast<float>(x) : x;
  return point;
}

/// The answer of a search of all triangles, of which the lowest index counts where several are
/// equally near.
LocatedPoint SearchAll(const Mesh& mesh, const Point& point) {
  LocatedPoint nearest;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const ClosestPoint closest = FindClosestPoint(Corners(mesh, t), point);
    if (!(closest.squared_distance_m2 < least)) continue;
    least = closest.squared_distance_m2;
    nearest = {t, mesh.triangles[t], closest.weights, std::sqrt(least)};
  }
  return nearest;
}

/// Compares the answers for points at `away` times the body's size from its surface.
void Compare(const std::string& name, const Mesh& mesh, double away, int count) {
  const std::vector<uint32_t> given(mesh.triangles.size());
  const auto locator = LocatorOf(mesh, given);
  const double size = SurfaceGrid(mesh.vertices, mesh.triangles).longest_side_m();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> offset(-away * size, away * size);
  int wrong_count = 0;
  for (int i = 0; i < count; ++i) {
    Point point = OnSurface(mesh, random);
    for (double& coordinate : point) coordinate += offset(random);
    const LocatedPoint expected = SearchAll(mesh, point);
    const LocatedPoint found = locator->Nearest(point).value();
    if (found.triangle == expected.triangle && found.vertices == expected.vertices &&
        found.weights == expected.weights && found.distance_m == expected.distance_m) {
      continue;
    }
    ++wrong_count;
    if (wrong_count > 3) continue;
    ADD_FAILURE() << name << ", " << away << " away: triangle " << found.triangle << " at "
                  << found.distance_m << " m instead of " << expected.triangle << " at "
                  << expected.distance_m << " m";
  }
  EXPECT_EQ(wrong_count, 0) << name << ", " << away << " away";
}

TEST(SurfaceGrid, FindsOfEverySurfaceExactlyWhatASearchOfAllTrianglesFinds) {
  for (const auto& [name, mesh] : Meshes()) {
    for (const double away : {0.0, 1e-7, 1e-3, 0.03, 0.3, 3.0}) Compare(name, mesh, away, 300);
  }
}

TEST(SurfaceGrid, ASurfaceThatIsNotFiniteOrADotHasNoCells) {
  Mesh mesh = MakeBox(1, 1, 1);
  mesh.vertices[3][1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(SurfaceGrid(mesh.vertices, mesh.triangles).usable());
  mesh.vertices.assign(8, {1, 2, 3});
  EXPECT_FALSE(SurfaceGrid(mesh.vertices, mesh.triangles).usable());
}

TEST(SurfaceGrid, APointFarFromABodyOfFewCellsIsFoundUntilItsDistanceOverflows) {
  const Mesh mesh = MakeBox(1, 1, 1);
  const std::vector<uint32_t> given(mesh.triangles.size());
  const auto locator = LocatorOf(mesh, given);
  EXPECT_FALSE(locator->Nearest({1e200, 0, 0}).ok());
  EXPECT_DOUBLE_EQ(locator->Nearest({1e6, 0.5, 0.5})->distance_m, 1e6 - 1);
}

}  // namespace
}  // namespace carillon
