// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/curved_edges.h"

namespace carillon::precompute {
namespace {

/// Distance of a mid-side node from the middle, in lengths of the edge, that is rounding: text
/// files often have seven digits.
constexpr double kStraight = 1e-6;

/// The edge between `a` and `b` with the mid-side node `middle`, all indices of nodes.
bool IsEdgeCurved(const TetMesh& mesh, int32_t a, int32_t b, int32_t middle) {
  const Point& p = mesh.nodes[static_cast<size_t>(a)];
  const Point& q = mesh.nodes[static_cast<size_t>(b)];
  const Point& m = mesh.nodes[static_cast<size_t>(middle)];
  double away = 0, length = 0;  // squared
  for (size_t x = 0; x < 3; ++x) {
    const double beside = m[x] - (p[x] + q[x]) / 2;
    away += beside * beside;
    length += (q[x] - p[x]) * (q[x] - p[x]);
  }
  return away > kStraight * kStraight * length;
}

}  // namespace

bool IsCurved(const TetMesh& mesh, size_t element) {
  if (mesh.nodes_per_element != 10) return false;
  const int32_t* nodes = &mesh.elements[10 * element];
  for (size_t e = 0; e < kTetEdges.size(); ++e) {
    const auto& [a, b] = kTetEdges[e];
    if (IsEdgeCurved(mesh, nodes[a], nodes[b], nodes[4 + e])) return true;
  }
  return false;
}

bool IsCurved(const TetMesh& mesh, const BoundaryFace& face) {
  const auto& n = face.nodes;
  if (n[3] < 0) return false;
  for (size_t i = 0; i < 3; ++i) {
    if (IsEdgeCurved(mesh, n[i], n[(i + 1) % 3], n[3 + i])) return true;
  }
  return false;
}

}  // namespace carillon::precompute
