// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/residual.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

namespace carillon::fit {
namespace {

constexpr std::array<std::pair<double, double>, 4> kSpans_s = {
    {{0, 0.005}, {0.005, 0.02}, {0.02, 0.1}, {0.1, 3}}};

double Energy(const std::vector<float>& samples, size_t from, size_t to) {
  double energy = 0;
  for (size_t n = from; n < std::min(to, samples.size()); ++n) {
    energy += double{samples[n]} * double{samples[n]};
  }
  return energy;
}

}  // namespace

Residual ResidualOf(const Ring& ring, size_t index, const std::vector<MeasuredMode>& modes) {
  Residual residual{.samples = ring.samples, .shares = {}};
  for (const MeasuredMode& mode : modes) {
    if (mode.amplitudes.empty() || std::norm(mode.amplitudes[index]) == 0) continue;
    const std::complex<double> turn = std::exp(
        std::complex<double>(-mode.heard_decay_per_s, 2 * std::numbers::pi * mode.heard_hz) /
        ring.sample_rate_hz);
    std::complex<double> value = mode.amplitudes[index];
    for (size_t n = ring.onset; n < ring.samples.size(); ++n) {
      residual.samples[n] -= static_cast<float>(value.real());
      value *= turn;
    }
  }
  for (const auto& [from_s, to_s] : kSpans_s) {
    const size_t from = ring.onset + static_cast<size_t>(from_s * ring.sample_rate_hz);
    const size_t to = ring.onset + static_cast<size_t>(to_s * ring.sample_rate_hz);
    const double whole = Energy(ring.samples, from, to);
    if (whole > 0) {
      residual.shares.push_back({from_s, to_s, Energy(residual.samples, from, to) / whole});
    }
  }
  return residual;
}

}  // namespace carillon::fit
