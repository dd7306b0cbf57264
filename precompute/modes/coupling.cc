// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/coupling.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

namespace carillon::precompute {

double IntegralOfAbsolute(double area, double f0, double f1, double f2) {
  // Makes f0 the corner whose sign is alone, if any.
  if (std::signbit(f1) != std::signbit(f2)) {
    std::swap(f0, std::signbit(f0) == std::signbit(f1) ? f2 : f1);
  }
  const double whole = area * (f0 + f1 + f2) / 3;
  if (std::signbit(f0) == std::signbit(f1) || f0 == 0) return std::abs(whole);
  // The line f = 0 cuts off the corner: a triangle with these parts of its two edges.
  const double cut = area * (f0 / (f0 - f1)) * (f0 / (f0 - f2)) * f0 / 3;
  return std::abs(whole - cut) + std::abs(cut);
}

Eigen::VectorXd Couplings(const TetMesh& mesh, const SoundingSurface& surface, const Modes& modes) {
  const auto node = [&](int32_t vertex) {
    return static_cast<Eigen::Index>(surface.nodes[static_cast<size_t>(vertex)]);
  };
  const auto position = [&](int32_t vertex) {
    return Eigen::Vector3d(mesh.nodes[static_cast<size_t>(node(vertex))].data());
  };
  Eigen::VectorXd integrals = Eigen::VectorXd::Zero(modes.eigenvalues.size());
  for (const auto& [a, b, c] : surface.triangles) {
    const Eigen::Vector3d normal =
        (position(b) - position(a)).cross(position(c) - position(a));  // twice the area long
    const double area = normal.norm() / 2;
    if (area == 0) continue;
    const Eigen::RowVector3d n = normal.transpose() / (2 * area);
    for (Eigen::Index m = 0; m < integrals.size(); ++m) {
      const auto along_normal = [&](int32_t vertex) {
        return n.dot(modes.shapes.block<3, 1>(3 * node(vertex), m));
      };
      integrals[m] += IntegralOfAbsolute(area, along_normal(a), along_normal(b), along_normal(c));
    }
  }
  return integrals.cwiseProduct(modes.eigenvalues.cwiseMax(0).cwiseSqrt());
}

}  // namespace carillon::precompute
