// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/curved_element.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "precompute/fem/tet_rule.h"
#include "precompute/mesh/curved_edges.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

using Derivatives = Eigen::Matrix<double, 10, 3>;
using Values = Eigen::Matrix<double, 10, 1>;

constexpr double kReferenceVolume = 1.0 / 6;

/// A determinant below this part of the element's largest counts as zero.
constexpr double kLeastDeterminant = 1e-6;

/// The derivatives of the shape functions with respect to the reference coordinates, at each point.
std::vector<Derivatives> DerivativesAt(const std::vector<TetRulePoint>& rule) {
  std::vector<Derivatives> derivatives;
  derivatives.reserve(rule.size());
  for (const TetRulePoint& point : rule) {
    derivatives.push_back(QuadraticGradients(ReferenceGradients(), point.barycentric));
  }
  return derivatives;
}

const std::vector<Derivatives>& StiffnessDerivatives() {
  static const std::vector<Derivatives> derivatives = DerivativesAt(TetRuleOfDegree5());
  return derivatives;
}

const std::vector<Derivatives>& MassDerivatives() {
  static const std::vector<Derivatives> derivatives = DerivativesAt(TetRuleOfDegree7());
  return derivatives;
}

const std::vector<Values>& MassValues() {
  static const std::vector<Values> values = [] {
    std::vector<Values> at_points;
    for (const TetRulePoint& point : TetRuleOfDegree7()) {
      at_points.push_back(QuadraticValues(point.barycentric));
    }
    return at_points;
  }();
  return values;
}

/// Calls use(k, volume of point k) for each point of the rule of degree seven. The volumes add up
/// to the element's.
template <typename Use>
void ForEachMassPoint(const TenNodes& nodes, const Use& use) {
  const std::vector<Derivatives>& derivatives = MassDerivatives();
  for (size_t k = 0; k < derivatives.size(); ++k) {
    const Eigen::Matrix3d jacobian = nodes * derivatives[k];
    use(k, TetRuleOfDegree7()[k].weight * kReferenceVolume * jacobian.determinant());
  }
}

/// The least determinant of the Jacobian at the quadrature points, as a part of the largest.
double LeastDeterminant(const TenNodes& nodes) {
  double least = HUGE_VAL, most = 0;
  for (const auto* derivatives : {&StiffnessDerivatives(), &MassDerivatives()}) {
    for (const Derivatives& at : *derivatives) {
      const Eigen::Matrix3d jacobian = nodes * at;
      least = std::min(least, jacobian.determinant());
      most = std::max(most, jacobian.determinant());
    }
  }
  return most > 0 ? least / most : -1;
}

}  // namespace

Eigen::Matrix<double, 4, 3> ReferenceGradients() {
  Eigen::Matrix<double, 4, 3> gradients;
  gradients << -1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  return gradients;
}

TenNodes NodesOf(const TetMesh& mesh, size_t element) {
  TenNodes nodes;
  for (size_t i = 0; i < 10; ++i) {
    const auto node = static_cast<size_t>(mesh.elements[10 * element + i]);
    nodes.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3d::Map(mesh.nodes[node].data());
  }
  return nodes;
}

QuadraticStiffness MakeCurvedStiffness(const TenNodes& nodes, const LameConstants& lame) {
  // Column k has the ten gradients at point k, times the root of the point's volume, so that the
  // integrated outer products of all pairs of nodes are one product of matrices.
  constexpr int kPoints = 14;
  Eigen::Matrix<double, 30, kPoints> gradients;
  const std::vector<Derivatives>& derivatives = StiffnessDerivatives();
  for (size_t k = 0; k < derivatives.size(); ++k) {
    const Eigen::Matrix3d jacobian = nodes * derivatives[k];
    const double volume = TetRuleOfDegree5()[k].weight * kReferenceVolume * jacobian.determinant();
    const Eigen::Matrix<double, 3, 10> at_point =
        std::sqrt(volume) * (derivatives[k] * jacobian.inverse()).transpose();
    gradients.col(static_cast<Eigen::Index>(k)) = at_point.reshaped();
  }
  const QuadraticStiffness outer = gradients * gradients.transpose();
  QuadraticStiffness stiffness;
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j <= i; ++j) {
      const Eigen::Matrix3d block = StiffnessBlock(outer.block<3, 3>(3 * i, 3 * j), lame);
      stiffness.block<3, 3>(3 * i, 3 * j) = block;
      stiffness.block<3, 3>(3 * j, 3 * i) = block.transpose();
    }
  }
  return stiffness;
}

QuadraticMass MakeCurvedMass(const TenNodes& nodes, double density_kg_per_m3, MassSharing sharing) {
  QuadraticMass mass = QuadraticMass::Zero();
  ForEachMassPoint(nodes, [&](size_t k, double volume_m3) {
    const Values& values = MassValues()[k];
    mass.noalias() += density_kg_per_m3 * volume_m3 * values * values.transpose();
  });
  if (sharing == MassSharing::kConsistent) return mass;
  const QuadraticMass diagonal = mass.diagonal().asDiagonal();
  return mass.sum() / diagonal.trace() * diagonal;
}

double CurvedVolumeM3(const TenNodes& nodes) {
  double volume = 0;
  ForEachMassPoint(nodes, [&](size_t, double volume_m3) { volume += volume_m3; });
  return volume;
}

absl::Status CheckCurvedElements(const TetMesh& mesh) {
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    if (!IsCurved(mesh, e)) continue;
    const TenNodes nodes = NodesOf(mesh, e);
    if (LeastDeterminant(nodes) > kLeastDeterminant) continue;
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_ELEMENT_INVERTED",
        absl::StrCat("tetrahedron ", e, " (counted from zero) near (", nodes(0, 0), ", ",
                     nodes(1, 0), ", ", nodes(2, 0),
                     ") is curved so much that a part of it is turned inside out (its Jacobian is "
                     "not positive): let the mesher optimise the elements of second order "
                     "(\"gmsh -optimize_ho\"), or make them smaller there"));
  }
  return absl::OkStatus();
}

}  // namespace carillon::precompute
