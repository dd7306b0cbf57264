// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// The real orthonormal spherical harmonics Y_lm up to an order, as
/// proto/carillon/v1/transfer.proto defines them, for one direction at a time. Only the constructor
/// allocates.
class HarmonicBasis {
 public:
  explicit HarmonicBasis(size_t order);

  size_t order() const noexcept { return order_; }

  /// Computes all harmonics of the unit vector `direction`.
  void Evaluate(const std::array<double, 3>& direction) noexcept;

  /// Y_lm at index l^2 + l + m.
  std::span<const float> values() const noexcept { return values_; }

 private:
  /// p_l = up z p_(l-1) - down p_(l-2) for the Legendre functions of one m.
  struct Step {
    double up = 0, down = 0;
  };

  size_t order_;
  std::vector<Step> steps_;  // by m, then by l from m + 1 on
  std::vector<float> values_;
};

}  // namespace carillon
