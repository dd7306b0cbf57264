// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/triangulate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

using Flat = std::array<double, 2>;

/// Twice the signed area of a triangle in the plane.
double Turn(const Flat& a, const Flat& b, const Flat& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// The corners as seen along the coordinate axis nearest to the normal (Newell), counter-clockwise.
std::vector<Flat> Flatten(std::span<const int32_t> polygon, const std::vector<Point>& vertices) {
  const auto at = [&](size_t i) {
    return Difference(vertices[static_cast<size_t>(polygon[i % polygon.size()])],
                      vertices[static_cast<size_t>(polygon[0])]);
  };
  Point normal{};
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point turn = Cross(at(i), at(i + 1));
    for (size_t x = 0; x < 3; ++x) normal[x] += turn[x];
  }
  size_t axis = 0;
  for (size_t x = 1; x < 3; ++x) {
    if (std::abs(normal[x]) > std::abs(normal[axis])) axis = x;
  }
  const double sign = normal[axis] < 0 ? -1 : 1;
  std::vector<Flat> flat;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point p = at(i);
    flat.push_back({p[(axis + 1) % 3], sign * p[(axis + 2) % 3]});
  }
  return flat;
}

/// Whether the corner `i` of those that are left can be cut off.
bool IsEar(const std::vector<Flat>& flat, const std::vector<size_t>& left, size_t i) {
  const size_t a = left[(i + left.size() - 1) % left.size()], b = left[i],
               c = left[(i + 1) % left.size()];
  if (!(Turn(flat[a], flat[b], flat[c]) > 0)) return false;
  return std::ranges::none_of(left, [&](size_t p) {
    if (flat[p] == flat[a] || flat[p] == flat[b] || flat[p] == flat[c]) return false;
    return Turn(flat[a], flat[b], flat[p]) >= 0 && Turn(flat[b], flat[c], flat[p]) >= 0 &&
           Turn(flat[c], flat[a], flat[p]) >= 0;
  });
}

}  // namespace

void Triangulate(std::span<const int32_t> polygon, const std::vector<Point>& vertices,
                 std::vector<std::array<int32_t, 3>>& triangles) {
  if (polygon.size() == 3) {
    triangles.push_back({polygon[0], polygon[1], polygon[2]});
    return;
  }
  const std::vector<Flat> flat = Flatten(polygon, vertices);
  std::vector<size_t> left(polygon.size());
  for (size_t i = 0; i < left.size(); ++i) left[i] = i;
  // The first ear after the corner beside the last one cut. Cutting off every other corner halves a
  // convex polygon in each round, so that few of its triangles are long and narrow.
  size_t next = 1;
  while (left.size() >= 3) {
    size_t tried = 0;
    while (tried < left.size() && !IsEar(flat, left, (next + tried) % left.size())) ++tried;
    // Without an ear the rest is folded or has no area, and any corner is as good.
    const size_t ear = (next + (tried < left.size() ? tried : 0)) % left.size();
    triangles.push_back({polygon[left[(ear + left.size() - 1) % left.size()]], polygon[left[ear]],
                         polygon[left[(ear + 1) % left.size()]]});
    left.erase(left.begin() + static_cast<ptrdiff_t>(ear));
    next = (ear + 1) % left.size();
  }
}

}  // namespace carillon::precompute
