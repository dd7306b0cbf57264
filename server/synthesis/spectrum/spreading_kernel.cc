// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/spectrum/spreading_kernel.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace carillon {
namespace {

using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;
constexpr double kWidth = kSpreadBins;
/// The shape of the kernel, pi w (1 - 1/(2 s)) for oversampling s = 2. With it the kernel's main
/// lobe ends where its images begin.
constexpr double kBeta = kPi * kWidth * 0.75;

/// I0(u) as a series in u^2; |u| is at most about kBeta.
Complex BesselI0(Complex u_squared) {
  Complex term = 1, sum = 1;
  for (int k = 1; k < 60; ++k) {
    term *= u_squared / (4.0 * k * k);
    sum += term;
    if (std::norm(term) < 1e-34 * std::norm(sum)) break;
  }
  return sum;
}

Complex Kernel(Complex x) {
  static const double peak = BesselI0(kBeta * kBeta).real();
  const Complex ratio = 2.0 * x / kWidth;
  return BesselI0(kBeta * kBeta * (1.0 - ratio * ratio)) / peak;
}

double KernelTransform(double frequency) {
  static const double peak = BesselI0(kBeta * kBeta).real();
  const double root = std::sqrt(kBeta * kBeta - std::pow(kPi * kWidth * frequency, 2));
  return kWidth * std::sinh(root) / (root * peak);
}

}  // namespace

SpreadMode MakeSpreadMode(std::complex<double> log_q, const LongBlock& block) {
  const Complex theta = log_q / Complex(0, 1);
  const Complex position = theta * static_cast<double>(block.grid_size) / (2 * kPi);
  const double first = std::ceil(position.real() - kWidth / 2);
  const size_t middle = block.frame_count / 2;
  const Complex to_middle = std::exp(log_q * static_cast<double>(middle));
  const double slot = first + kWidth / 2;
  assert(slot >= 0 && slot < static_cast<double>(SlotCount(block.grid_size)));
  SpreadMode mode{.slot = static_cast<size_t>(slot), .weights = {}};
  for (size_t k = 0; k < kSpreadBins; ++k) {
    mode.weights[k] =
        std::complex<float>(to_middle * Kernel(first + static_cast<double>(k) - position));
  }
  return mode;
}

std::vector<float> MakeDeconvolution(const LongBlock& block) {
  const size_t middle = block.frame_count / 2;
  std::vector<float> factors(block.frame_count);
  for (size_t n = 0; n < block.frame_count; ++n) {
    const double frame = static_cast<double>(n) - static_cast<double>(middle);
    factors[n] =
        static_cast<float>(1 / KernelTransform(frame / static_cast<double>(block.grid_size)));
  }
  return factors;
}

}  // namespace carillon
