// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "precompute/fem/curved_element.h"
#include "precompute/fem/elastic_constants.h"

namespace carillon::precompute {

/// Computes integrals over curved elements by the rule of degree five. The integrands are products
/// of the functions that the next order adds (see AddedFunctions) with the element's own functions
/// and with themselves.
class CurvedIntegrals {
 public:
  /// Unknown 3 i + a is component a of function i.
  struct Mixed {
    Eigen::Matrix<double, 30, 30> stiffness;  ///< a(added, own)
    Eigen::Matrix<double, 10, 10> mass;       ///< m(added, own), for unit density
  };

  CurvedIntegrals();

  Mixed OfBoth(const TenNodes& nodes, const LameConstants& lame) const;

  /// Returns a(b, b) of each added function b, one 3 by 3 block after the other.
  Eigen::Matrix<double, 3, 30> OfAdded(const TenNodes& nodes, const LameConstants& lame) const;

 private:
  /// The ten functions at a point, and their derivatives with respect to the reference
  /// coordinates.
  struct TenFunctions {
    Eigen::Matrix<double, 10, 1> values;
    Eigen::Matrix<double, 10, 3> derivatives;
  };

  std::vector<TenFunctions> own_;  // the element's own functions at each point of the rule
  std::vector<TenFunctions> added_;
};

}  // namespace carillon::precompute
