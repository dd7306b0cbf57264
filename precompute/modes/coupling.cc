// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/coupling.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "precompute/mesh/curved_edges.h"

namespace carillon::precompute {
namespace {

/// A triangle of the surface.
struct Facet {
  Eigen::Vector3d normal;           ///< of length one
  double area;                      ///< m^2
  std::array<Eigen::Index, 3> row;  ///< row in the shapes of each corner's first component
};

/// A triangle of a curved face. The cross product of the face's two tangents varies along the face.
/// `normal` is that product at each corner, and integrals are taken in the face's own coordinates.
struct CurvedFacet {
  std::array<Eigen::Vector3d, 3> normal;
  std::array<Eigen::Index, 3> row;
};

/// Area of a quarter of the triangle (0, 0), (1, 0), (0, 1).
constexpr double kQuarterArea = 0.125;

/// Returns the face of the boundary to which a triangle belongs.
const BoundaryFace& FaceOf(const TetMesh& mesh, const SoundingSurface& surface, size_t triangle) {
  return mesh.boundary[triangle * mesh.boundary.size() / surface.triangles.size()];
}

/// Returns the cross product of the tangents of a six-node face at the face's node `at`. The
/// tangents are derivatives with respect to two barycentric coordinates, where the remaining
/// coordinate decreases accordingly.
Eigen::Vector3d NormalAt(const TetMesh& mesh, const BoundaryFace& face, size_t at) {
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  for (const size_t corner : {at % 3, at < 3 ? at : (at + 1) % 3}) {
    barycentric[static_cast<Eigen::Index>(corner)] = at < 3 ? 1 : 0.5;
  }
  Eigen::Matrix3d derivatives = Eigen::Matrix3d::Zero();  // column i: with respect to coordinate i
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Index j = (i + 1) % 3;
    const auto place = [&](Eigen::Index n) {
      return Eigen::Vector3d::Map(
          mesh.nodes[static_cast<size_t>(face.nodes[static_cast<size_t>(n)])].data());
    };
    derivatives.col(i) += (4 * barycentric[i] - 1) * place(i) + 4 * barycentric[j] * place(3 + i);
    derivatives.col(j) += 4 * barycentric[i] * place(3 + i);
  }
  const Eigen::Vector3d along = derivatives.col(1) - derivatives.col(0);
  return along.cross(derivatives.col(2) - derivatives.col(0));
}

std::vector<CurvedFacet> CurvedFacets(const TetMesh& mesh, const SoundingSurface& surface) {
  std::vector<CurvedFacet> facets;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const BoundaryFace& face = FaceOf(mesh, surface, t);
    if (!IsCurved(mesh, face)) continue;
    CurvedFacet& facet = facets.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      const int32_t node = surface.nodes[static_cast<size_t>(surface.triangles[t][i])];
      facet.row[i] = 3 * Eigen::Index{node};
      const auto at = static_cast<size_t>(std::ranges::find(face.nodes, node) - face.nodes.begin());
      facet.normal[i] = NormalAt(mesh, face, at);
    }
  }
  return facets;
}

/// Returns the facets of the straight faces.
std::vector<Facet> Facets(const TetMesh& mesh, const SoundingSurface& surface) {
  std::vector<Facet> facets;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    if (IsCurved(mesh, FaceOf(mesh, surface, t))) continue;
    const auto& triangle = surface.triangles[t];
    std::array<Eigen::Index, 3> row{};
    std::array<Eigen::Vector3d, 3> at;
    for (size_t i = 0; i < 3; ++i) {
      const int32_t node = surface.nodes[static_cast<size_t>(triangle[i])];
      row[i] = 3 * static_cast<Eigen::Index>(node);
      at[i] = Eigen::Vector3d::Map(mesh.nodes[static_cast<size_t>(node)].data());
    }
    const Eigen::Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]);  // length: twice the area
    const double area = normal.norm() / 2;
    if (area != 0) facets.push_back({.normal = normal / (2 * area), .area = area, .row = row});
  }
  return facets;
}

}  // namespace

double IntegralOfAbsolute(double area, double f0, double f1, double f2) {
  // Makes f0 the value whose sign differs from that of the two others, if there is one.
  if (std::signbit(f1) != std::signbit(f2)) {
    std::swap(f0, std::signbit(f0) == std::signbit(f1) ? f2 : f1);
  }
  const double whole = area * (f0 + f1 + f2) / 3;
  if (std::signbit(f0) == std::signbit(f1) || f0 == 0) return std::abs(whole);
  // The line f = 0 cuts off this corner. The triangle that is cut off has these fractions of the
  // two edges.
  const double cut = area * (f0 / (f0 - f1)) * (f0 / (f0 - f2)) * f0 / 3;
  return std::abs(whole - cut) + std::abs(cut);
}

Eigen::VectorXd Couplings(const TetMesh& mesh, const SoundingSurface& surface, const Modes& modes) {
  const std::vector<Facet> facets = Facets(mesh, surface);
  const std::vector<CurvedFacet> curved = CurvedFacets(mesh, surface);
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
    for (const CurvedFacet& facet : curved) {
      const auto along_normal = [&](size_t corner) {
        return facet.normal[corner].dot(shape.segment<3>(facet.row[corner]));
      };
      integrals[m] +=
          IntegralOfAbsolute(kQuarterArea, along_normal(0), along_normal(1), along_normal(2));
    }
  }
  return integrals.cwiseProduct(modes.eigenvalues.cwiseMax(0).cwiseSqrt());
}

}  // namespace carillon::precompute
