// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/region_energies.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "absl/container/flat_hash_map.h"
#include "precompute/fem/assembly.h"
#include "precompute/mesh/point_math.h"

namespace carillon::precompute {
namespace {

/// The elements of one region, with nodes of their own.
struct RegionMesh {
  TetMesh mesh;
  std::vector<int32_t> whole;  ///< for each node, its number in the whole mesh
};

RegionMesh MeshOf(size_t region, const TetMesh& mesh) {
  RegionMesh part;
  part.mesh.nodes_per_element = mesh.nodes_per_element;
  std::vector<int32_t> own(mesh.nodes.size(), -1);
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    if (mesh.RegionOf(e) != region) continue;
    for (size_t i = 0; i < stride; ++i) {
      const int32_t node = mesh.elements[e * stride + i];
      int32_t& number = own[static_cast<size_t>(node)];
      if (number < 0) {
        number = static_cast<int32_t>(part.whole.size());
        part.whole.push_back(node);
        part.mesh.nodes.push_back(mesh.nodes[static_cast<size_t>(node)]);
      }
      part.mesh.elements.push_back(number);
    }
  }
  return part;
}

/// Twice the energy of a vector.
double Energy(const SystemMatrices::Sparse& matrix, const Eigen::VectorXd& vector) {
  return vector.dot(matrix.selfadjointView<Eigen::Lower>() * vector);
}

/// Turns the energies of all regions into parts of their sum.
void Normalize(std::vector<double> ModelRegion::*energies, std::vector<ModelRegion>& regions) {
  for (size_t m = 0; m < (regions.front().*energies).size(); ++m) {
    double sum = 0;
    for (const ModelRegion& region : regions) sum += (region.*energies)[m];
    for (ModelRegion& region : regions) (region.*energies)[m] /= sum;
  }
}

}  // namespace

std::vector<ModelRegion> RegionEnergies(const TetMesh& mesh, const BodyMaterials& materials,
                                        const Modes& modes) {
  std::vector<ModelRegion> regions;
  for (const RegionMaterial& material : materials.regions()) {
    const RegionMesh part = MeshOf(regions.size(), mesh);
    const SystemMatrices system =
        Assemble(part.mesh, material.elastic, material.density_kg_per_m3, MassSharing::kConsistent);
    ModelRegion& region = regions.emplace_back(ModelRegion{material, {}, {}});
    Eigen::VectorXd shape(system.unknown_count());
    for (Eigen::Index m = 0; m < modes.shapes.cols(); ++m) {
      for (size_t n = 0; n < part.whole.size(); ++n) {
        shape.segment<3>(static_cast<Eigen::Index>(3 * n)) =
            modes.shapes.col(m).segment<3>(3 * Eigen::Index{part.whole[n]});
      }
      region.strain_parts.push_back(Energy(system.K, shape));
      region.kinetic_parts.push_back(Energy(system.M, shape));
    }
  }
  Normalize(&ModelRegion::strain_parts, regions);
  Normalize(&ModelRegion::kinetic_parts, regions);
  return regions;
}

std::vector<uint8_t> GivenTriangleRegions(const TetMesh& mesh, const SurfaceMesh& given) {
  using Corners = std::array<int32_t, 3>;
  absl::flat_hash_map<Corners, int32_t> given_of_face;
  for (const BoundaryFace& face : mesh.boundary) {
    Corners corners = {face.nodes[0], face.nodes[1], face.nodes[2]};
    std::ranges::sort(corners);
    given_of_face[corners] = face.given_triangle;
  }
  std::vector<uint8_t> regions(given.triangles.size(), 0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* nodes = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    for (const auto& [a, b, c] : kTetFaces) {
      Corners corners = {nodes[a], nodes[b], nodes[c]};
      std::ranges::sort(corners);
      const auto found = given_of_face.find(corners);
      if (found == given_of_face.end()) continue;
      regions[static_cast<size_t>(found->second)] = static_cast<uint8_t>(mesh.RegionOf(e));
    }
  }
  return regions;
}

std::vector<double> MassMoments(const TetMesh& mesh, const BodyMaterials& materials) {
  // In homogeneous coordinates p = (1, x, y, z), the integral of p p^T over a tetrahedron of volume
  // V is V/20 (s s^T + sum of p_i p_i^T), where s is the sum of its corners p_i.
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const int32_t* nodes = &mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element)];
    const auto at = [&](size_t i) -> const Point& {
      return mesh.nodes[static_cast<size_t>(nodes[i])];
    };
    Eigen::Matrix4d corners;
    for (size_t i = 0; i < 4; ++i) {
      corners.col(static_cast<Eigen::Index>(i)) << 1, at(i)[0], at(i)[1], at(i)[2];
    }
    const double mass = materials.DensityOf(mesh, e) * TetVolume(at(0), at(1), at(2), at(3));
    const Eigen::Vector4d sum = corners.rowwise().sum();
    moments += mass / 20 * (sum * sum.transpose() + corners * corners.transpose());
  }
  return {moments(0, 0), moments(1, 0), moments(2, 0), moments(3, 0), moments(1, 1),
          moments(2, 2), moments(3, 3), moments(1, 2), moments(2, 3), moments(3, 1)};
}

}  // namespace carillon::precompute
