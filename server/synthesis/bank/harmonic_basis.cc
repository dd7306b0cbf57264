// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/harmonic_basis.h"

#include <cmath>
#include <numbers>

namespace carillon {

HarmonicBasis::HarmonicBasis(size_t order) : order_(order), values_((order + 1) * (order + 1)) {
  for (size_t m = 0; m < order; ++m) {
    for (size_t l = m + 1; l <= order; ++l) {
      const auto ll = static_cast<double>(l * l), mm = static_cast<double>(m * m);
      const auto before = static_cast<double>((l - 1) * (l - 1));
      const double up = std::sqrt((4 * ll - 1) / (ll - mm));
      const double down = l == m + 1 ? 0 : up * std::sqrt((before - mm) / (4 * before - 1));
      steps_.push_back({.up = up, .down = down});
    }
  }
}

/// The Legendre functions are divided by sin^m theta, which is part of (x + iy)^m instead.
void HarmonicBasis::Evaluate(const std::array<double, 3>& direction) noexcept {
  const auto [x, y, z] = direction;
  double legendre_mm = std::sqrt(1 / (4 * std::numbers::pi));
  double cosine = 1, sine = 0;  // of m phi, times sin^m theta and the square root of two for m > 0
  auto step = steps_.begin();
  for (size_t m = 0; m <= order_; ++m) {
    if (m > 0) {
      const auto twice = static_cast<double>(2 * m);
      legendre_mm *= std::sqrt((twice + 1) / twice);
      const double scale = m == 1 ? std::numbers::sqrt2 : 1;
      const double next = scale * (cosine * x - sine * y);
      sine = scale * (cosine * y + sine * x);
      cosine = next;
    }
    double before = 0, legendre = legendre_mm;
    for (size_t l = m;; ++l, ++step) {
      values_[l * l + l - m] = static_cast<float>(sine * legendre);
      values_[l * l + l + m] = static_cast<float>(cosine * legendre);
      if (l == order_) break;
      const double next = step->up * z * legendre - step->down * before;
      before = legendre;
      legendre = next;
    }
  }
}

}  // namespace carillon
