// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/coupling.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace carillon::precompute {
namespace {

/// A triangle of the surface.
struct Facet {
  Eigen::Vector3d normal;           ///< of length one
  double area;                      ///< m^2
  std::array<Eigen::Index, 3> row;  ///< of the shapes, of its corners' first components
};

std::vector<Facet> Facets(const TetMesh& mesh, const SoundingSurface& surface) {
  std::vector<Facet> facets;
  for (const auto& triangle : surface.triangles) {
    std::array<Eigen::Index, 3> row{};
    std::array<Eigen::Vector3d, 3> at;
    for (size_t i = 0; i < 3; ++i) {
      const int32_t node = surface.nodes[static_cast<size_t>(triangle[i])];
      row[i] = 3 * static_cast<Eigen::Index>(node);
      at[i] = Eigen::Vector3d::Map(mesh.nodes[static_cast<size_t>(node)].data());
    }
    const Eigen::Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]);  // twice the area long
    const double area = normal.norm() / 2;
    if (area != 0) facets.push_back({.normal = normal / (2 * area), .area = area, .row = row});
  }
  return facets;
}

}  // namespace

double IntegralOfAbsolute(double area, double f0, double f1, double f2) {
  // Makes f0 the corner whose sign differs from the two others, if there is one.
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
  const std::vector<Facet> facets = Facets(mesh, surface);
  Eigen::VectorXd integrals = Eigen::VectorXd::Zero(modes.eigenvalues.size());
  // The outer loop is over modes, because the shape of a mode is contiguous in memory.
  for (Eigen::Index m = 0; m < integrals.size(); ++m) {
    const auto shape = modes.shapes.col(m);
    for (const Facet& facet : facets) {
      const auto along_normal = [&](size_t corner) {
        return facet.normal.dot(shape.segment<3>(facet.row[corner]));
      };
      integrals[m] +=
          IntegralOfAbsolute(facet.area, along_normal(0), along_normal(1), along_normal(2));
    }
  }
  return integrals.cwiseProduct(modes.eigenvalues.cwiseMax(0).cwiseSqrt());
}

}  // namespace carillon::precompute
