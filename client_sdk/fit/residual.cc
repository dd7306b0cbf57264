// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/residual.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <utility>

namespace carillon::fit {
namespace {

/// The blow itself, and modes that end at once, are over by then.
constexpr double kSettled_s = 0.005;
constexpr int kSweeps = 3;
/// The rates of a mode in two strikes of one body differ by less, relative.
constexpr double kMostChange = 2e-3;
constexpr std::array<std::pair<double, double>, 4> kSpans_s = {
    {{0, 0.005}, {0.005, 0.02}, {0.02, 0.1}, {0.1, 3}}};

double Energy(const std::vector<float>& samples, size_t from, size_t to) {
  double energy = 0;
  for (size_t n = from; n < std::min(to, samples.size()); ++n) {
    energy += double{samples[n]} * double{samples[n]};
  }
  return energy;
}

/// A mode as one ring has it: amplitude exp(rate t) from the blow on.
struct Exponential {
  std::complex<double> rate, amplitude;
};

/// Adds the mode, times `sign`, to the samples from the blow on.
void Add(const Exponential& mode, double sign, double sample_rate_hz, std::span<double> samples) {
  const std::complex<double> turn = std::exp(mode.rate / sample_rate_hz);
  std::complex<double> value = sign * mode.amplitude;
  for (double& sample : samples) {
    sample += value.real();
    value *= turn;
  }
}

/// Fits the mode to the samples, by least squares with the derivative of its rate.
void Fit(double sample_rate_hz, std::span<const double> samples, Exponential& mode) {
  const std::complex<double> turn = std::exp(mode.rate / sample_rate_hz);
  std::complex<double> value = 1;
  Eigen::Matrix4d products = Eigen::Matrix4d::Zero();
  Eigen::Vector4d sums = Eigen::Vector4d::Zero();
  for (size_t n = 0; n < samples.size(); ++n) {
    const double time_s = static_cast<double>(n) / sample_rate_hz;
    const Eigen::Vector4d row(value.real(), -value.imag(), time_s * value.real(),
                              -time_s * value.imag());
    products += row * row.transpose();
    sums += samples[n] * row;
    value *= turn;
  }
  const Eigen::Vector4d found = products.ldlt().solve(sums);
  const std::complex<double> amplitude(found[0], found[1]);
  if (!found.allFinite() || std::norm(amplitude) == 0) return;
  const std::complex<double> change = std::complex<double>(found[2], found[3]) / amplitude;
  const std::complex<double> rate = mode.rate + change;
  // A mode that would become another one, or ring up, stays what it is.
  if (std::abs(change) > kMostChange * std::abs(mode.rate) || rate.real() > 0) return;
  mode = {rate, amplitude};
}

}  // namespace

Residual ResidualOf(const Ring& ring, size_t index, const std::vector<MeasuredMode>& modes) {
  const double rate_hz = ring.sample_rate_hz;
  std::vector<double> rest(ring.samples.begin(), ring.samples.end());
  const std::span<double> after = std::span(rest).subspan(ring.onset);
  std::vector<Exponential> own;
  for (const MeasuredMode& mode : modes) {
    if (mode.amplitudes.empty() || std::norm(mode.amplitudes[index]) == 0) continue;
    own.push_back(
        {{-mode.heard_decay_per_s, 2 * std::numbers::pi * mode.heard_hz}, mode.amplitudes[index]});
    Add(own.back(), -1, rate_hz, after);
  }
  // Frequencies of several strikes are their mean, from which each strike is a little off.
  const auto settled = std::min(static_cast<size_t>(kSettled_s * rate_hz), after.size());
  const double settled_s = static_cast<double>(settled) / rate_hz;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (Exponential& mode : own) {
      Add(mode, 1, rate_hz, after);
      Exponential later{mode.rate, mode.amplitude * std::exp(mode.rate * settled_s)};
      Fit(rate_hz, after.subspan(settled), later);
      mode = {later.rate, later.amplitude * std::exp(-later.rate * settled_s)};
      Add(mode, -1, rate_hz, after);
    }
  }
  Residual residual{.samples = {rest.begin(), rest.end()}, .shares = {}};
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
