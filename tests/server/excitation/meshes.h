// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/excitation/contact.h"

namespace carillon {

using Vertex = std::array<float, 3>;
using Triangle = std::array<uint32_t, 3>;

struct Mesh {
  std::vector<Vertex> vertices{};
  std::vector<Triangle> triangles{};

  void Add(const Mesh& other, float scale = 1, const Vertex& shift = {}) {
    const auto begin = static_cast<uint32_t>(vertices.size());
    for (const auto& [x, y, z] : other.vertices) {
      vertices.push_back({scale * x + shift[0], scale * y + shift[1], scale * z + shift[2]});
    }
    for (const auto& [a, b, c] : other.triangles) {
      triangles.push_back({a + begin, b + begin, c + begin});
    }
  }

  void TurnInsideOut() {
    for (Triangle& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }

  Point At(const Triangle& triangle, const std::array<double, 3>& weights) const {
    Point point{};
    for (size_t i = 0; i < 3; ++i) {
      for (size_t axis = 0; axis < 3; ++axis) {
        point[axis] += weights[i] * double{vertices[triangle[i]][axis]};
      }
    }
    return point;
  }
};

inline Vertex ToVertex(double x, double y, double z) {
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// A surface of `rings` rings of `sides` facets about z. `profile(ring)` gives the distance from
/// the axis and the height of the vertices of a ring, from the top.
template <class Profile>
Mesh Lathe(uint32_t rings, uint32_t sides, const Profile& profile) {
  Mesh mesh;
  for (uint32_t ring = 0; ring <= rings; ++ring) {
    const auto [radius, height] = profile(ring);
    for (uint32_t side = 0; side < sides; ++side) {
      const double angle = 2 * M_PI * side / sides;
      mesh.vertices.push_back(ToVertex(radius * std::cos(angle), radius * std::sin(angle), height));
    }
  }
  for (uint32_t ring = 0; ring < rings; ++ring) {
    for (uint32_t side = 0; side < sides; ++side) {
      const uint32_t a = ring * sides + side, b = ring * sides + (side + 1) % sides;
      mesh.triangles.push_back({a, a + sides, b});
      mesh.triangles.push_back({b, a + sides, b + sides});
    }
  }
  return mesh;
}

/// A sphere about the origin, which is open where the poles would be nearer than `cut`, a part of
/// the way from pole to pole.
inline Mesh MakeSphere(double radius, uint32_t rings, uint32_t sides, double cut = 0) {
  return Lathe(rings, sides, [=](uint32_t ring) {
    const double down = M_PI * (cut + (1 - 2 * cut) * ring / rings);
    return std::pair(radius * std::sin(down), radius * std::cos(down));
  });
}

/// A box of 12 triangles from the origin to (x, y, z).
inline Mesh MakeBox(double x, double y, double z) {
  Mesh mesh;
  for (uint32_t i = 0; i < 8; ++i) {
    mesh.vertices.push_back(ToVertex((i & 1) * x, (i >> 1 & 1) * y, (i >> 2 & 1) * z));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace carillon
