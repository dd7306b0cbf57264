// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/curved_integrals.h"

#include <Eigen/LU>

#include "precompute/fem/tet_rule.h"
#include "precompute/modes/added_functions.h"

namespace carillon::precompute {
namespace {

constexpr int kPoints = 14;
/// Column k contains the gradients of the ten functions at point k, one after the other.
using Gradients = Eigen::Matrix<double, 30, kPoints>;

/// The Jacobian of an element's mapping at a point of the rule.
struct Mapping {
  Eigen::Matrix3d inverse;
  double volume_m3;  ///< the part of the element for which the point stands
};

Mapping MappingAt(const TenNodes& nodes, const Eigen::Matrix<double, 10, 3>& own, double weight) {
  const Eigen::Matrix3d jacobian = nodes * own;
  return {jacobian.inverse(), weight / 6 * jacobian.determinant()};
}

}  // namespace

CurvedIntegrals::CurvedIntegrals() {
  const auto collect = [](const std::vector<FunctionAt>& functions) {
    TenFunctions ten;
    for (Eigen::Index i = 0; i < 10; ++i) {
      const FunctionAt& f = functions[static_cast<size_t>(i)];
      ten.values[i] = f.value;
      ten.derivatives.row(i) = f.derivative.transpose() * ReferenceGradients();
    }
    return ten;
  };
  for (const TetRulePoint& point : TetRuleOfDegree5()) {
    own_.push_back(collect(BaseFunctions(point.barycentric, 10)));
    added_.push_back(collect(AddedFunctions(point.barycentric, 10)));
  }
}

CurvedIntegrals::Mixed CurvedIntegrals::OfBoth(const TenNodes& nodes,
                                               const LameConstants& lame) const {
  Gradients own, added;
  Mixed mixed{.stiffness = {}, .mass = Eigen::Matrix<double, 10, 10>::Zero()};
  for (int k = 0; k < kPoints; ++k) {
    const TenFunctions& of_element = own_[static_cast<size_t>(k)];
    const TenFunctions& of_next = added_[static_cast<size_t>(k)];
    const Mapping mapping =
        MappingAt(nodes, of_element.derivatives, TetRuleOfDegree5()[static_cast<size_t>(k)].weight);
    const Eigen::Matrix<double, 3, 10> own_at =
        (of_element.derivatives * mapping.inverse).transpose();
    const Eigen::Matrix<double, 3, 10> added_at =
        mapping.volume_m3 * (of_next.derivatives * mapping.inverse).transpose();
    own.col(k) = own_at.reshaped();
    added.col(k) = added_at.reshaped();
    mixed.mass.noalias() += mapping.volume_m3 * of_next.values * of_element.values.transpose();
  }
  const Eigen::Matrix<double, 30, 30> outer = added * own.transpose();
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 10; ++j) {
      mixed.stiffness.block<3, 3>(3 * i, 3 * j) =
          StiffnessBlock(outer.block<3, 3>(3 * i, 3 * j), lame);
    }
  }
  return mixed;
}

Eigen::Matrix<double, 3, 30> CurvedIntegrals::OfAdded(const TenNodes& nodes,
                                                      const LameConstants& lame) const {
  Eigen::Matrix<double, 3, 30> outer = Eigen::Matrix<double, 3, 30>::Zero();
  for (size_t k = 0; k < own_.size(); ++k) {
    const Mapping mapping = MappingAt(nodes, own_[k].derivatives, TetRuleOfDegree5()[k].weight);
    const Eigen::Matrix<double, 10, 3> at = added_[k].derivatives * mapping.inverse;
    for (int i = 0; i < 10; ++i) {
      outer.middleCols<3>(3 * i) += mapping.volume_m3 * at.row(i).transpose() * at.row(i);
    }
  }
  for (int i = 0; i < 10; ++i) {
    const Eigen::Matrix3d block = outer.middleCols<3>(3 * i);
    outer.middleCols<3>(3 * i) = StiffnessBlock(block, lame);
  }
  return outer;
}

}  // namespace carillon::precompute
