// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/spherical_harmonics.h"

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace carillon::precompute {
namespace {

constexpr double kPi = std::numbers::pi;

/// Returns n_lm P_l^m(x) for 0 <= m <= l <= order at index l (l + 1)/2 + m. The recurrence upwards
/// in l is stable.
std::vector<double> Legendre(int order, double x) {
  const auto at = [](int l, int m) { return static_cast<size_t>(l * (l + 1) / 2 + m); };
  std::vector<double> p(at(order, order) + 1);
  const double sine = std::sqrt(std::max(0.0, 1 - x * x));
  p[0] = std::sqrt(1 / (4 * kPi));
  for (int m = 1; m <= order; ++m) {
    p[at(m, m)] = sine * std::sqrt((2.0 * m + 1) / (2 * m)) * p[at(m - 1, m - 1)];
  }
  for (int m = 0; m < order; ++m) {
    p[at(m + 1, m)] = x * std::sqrt(2.0 * m + 3) * p[at(m, m)];
    for (int l = m + 2; l <= order; ++l) {
      const double square = 1.0 * l * l, before = 1.0 * (l - 1) * (l - 1), mm = 1.0 * m * m;
      const double a = std::sqrt((4 * square - 1) / (square - mm));
      const double b = std::sqrt((before - mm) / (4 * before - 1));
      p[at(l, m)] = a * (x * p[at(l - 1, m)] - b * p[at(l - 2, m)]);
    }
  }
  return p;
}

/// Returns cos(m phi), or sin(|m| phi) for m < 0, at step j of `around`.
double Wave(int m, int j, int around) {
  const double phi = 2 * kPi * ((m * j) % around) / around;
  return m < 0 ? std::sin(-phi) : std::cos(phi);
}

/// Returns the constant factor of the harmonics of degree m, which multiplies n_l|m| P_l^|m| and
/// the wave.
double DegreeFactor(int m) { return m == 0 ? 1 : std::numbers::sqrt2; }

/// Returns the value and the derivative of the Legendre polynomial of degree n.
std::pair<double, double> LegendrePolynomial(int n, double x) {
  double before = 1, value = x;
  for (int l = 2; l <= n; ++l) {
    before = std::exchange(value, ((2 * l - 1) * x * value - (l - 1) * before) / l);
  }
  return {value, n * (x * value - before) / (x * x - 1)};
}

/// Returns node i of the n nodes of Gauss's rule on [-1, 1], and its weight, by Newton's iteration.
std::pair<double, double> GaussNode(int n, int i) {
  double x = std::cos(kPi * (i + 0.75) / (n + 0.5));
  for (int step = 0; step < 20; ++step) {
    const auto [value, slope] = LegendrePolynomial(n, x);
    x -= value / slope;
  }
  const double slope = LegendrePolynomial(n, x).second;
  return {x, 2 / ((1 - x * x) * slope * slope)};
}

}  // namespace

SphereGrid::SphereGrid(int order) : order_(order) {
  const int rings = order + 1, around = 2 * order + 2;
  for (int i = 0; i < rings; ++i) {
    const auto [z, weight] = GaussNode(rings, i);
    const double sine = std::sqrt(1 - z * z);
    for (int j = 0; j < around; ++j) {
      const double phi = 2 * kPi * j / around;
      directions_.push_back({sine * std::cos(phi), sine * std::sin(phi), z});
      weights_.push_back(weight * 2 * kPi / around);
    }
  }
}

std::vector<std::complex<double>> SphereGrid::Analyse(
    std::span<const std::complex<double>> values) const {
  const int rings = order_ + 1, around = 2 * order_ + 2;
  std::vector<std::complex<double>> result(HarmonicCount(order_));
  std::vector<std::complex<double>> waves(static_cast<size_t>(2 * order_ + 1));
  for (int i = 0; i < rings; ++i) {
    const auto first = static_cast<size_t>(i * around);
    // The Fourier coefficients of the values on this circle, for m = -order ... order.
    for (int m = -order_; m <= order_; ++m) {
      std::complex<double> sum = 0;
      for (int j = 0; j < around; ++j) {
        sum += values[first + static_cast<size_t>(j)] * Wave(m, j, around);
      }
      waves[static_cast<size_t>(m + order_)] = DegreeFactor(m) * sum;
    }
    const std::vector<double> p = Legendre(order_, directions_[first][2]);
    for (int l = 0; l <= order_; ++l) {
      for (int m = -l; m <= l; ++m) {
        result[HarmonicIndex(l, m)] += weights_[first] * waves[static_cast<size_t>(m + order_)] *
                                       p[static_cast<size_t>(l * (l + 1) / 2 + std::abs(m))];
      }
    }
  }
  return result;
}

std::vector<std::complex<double>> SphereGrid::Synthesise(
    std::span<const std::complex<double>> coefficients) const {
  const int rings = order_ + 1, around = 2 * order_ + 2;
  std::vector<std::complex<double>> result(directions_.size());
  for (int i = 0; i < rings; ++i) {
    const auto first = static_cast<size_t>(i * around);
    const std::vector<double> p = Legendre(order_, directions_[first][2]);
    for (int m = -order_; m <= order_; ++m) {
      std::complex<double> ring = 0;
      for (int l = std::abs(m); l <= order_; ++l) {
        ring += coefficients[HarmonicIndex(l, m)] *
                p[static_cast<size_t>(l * (l + 1) / 2 + std::abs(m))];
      }
      ring *= DegreeFactor(m);
      for (int j = 0; j < around; ++j) {
        result[first + static_cast<size_t>(j)] += ring * Wave(m, j, around);
      }
    }
  }
  return result;
}

}  // namespace carillon::precompute
