// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/damping_law.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "client_sdk/fit/statistics.h"

namespace carillon::fit {
namespace {

/// Below this the deviation of a decay rate is no worse than none: the loss is rounded.
constexpr double kRounded = 0.03;
/// No law is held to be exacter than this.
constexpr double kExact = 0.01;
constexpr int kMostRounds = 60;

using Figures = std::vector<double>;  // logarithms
using MakeLaw = std::function<DampingLaw(const Figures&)>;

double WeightOf(const MeasuredDecay& decay) { return 0.1 / (0.1 + decay.relative_error); }

double Deviation(const MeasuredDecay& decay, const DampingLaw& law) {
  return std::log(decay.decay_per_s / (law.DecayPerS(decay.frequency_hz) + decay.radiation_per_s));
}

double Loss(const std::vector<MeasuredDecay>& decays, const DampingLaw& law) {
  double loss = 0;
  for (const MeasuredDecay& decay : decays) {
    loss += WeightOf(decay) * std::hypot(Deviation(decay, law), kRounded);
  }
  return loss;
}

/// Lowers the loss by changing one figure after the other, and all together, by steps that shrink.
Figures Minimize(const std::vector<MeasuredDecay>& decays, Figures figures, const MakeLaw& make) {
  double least = Loss(decays, make(figures));
  double step = 1;
  const auto tries = [&](const Figures& tried) {
    const double loss = Loss(decays, make(tried));
    if (loss >= least) return false;
    least = loss, figures = tried;
    return true;
  };
  for (int round = 0; round < 40 * kMostRounds && step > 1e-5; ++round) {
    bool better = false;
    for (const double by : {step, -step}) {
      for (size_t i = 0; i < figures.size(); ++i) {
        // One figure, it and its neighbour against each other, and all up to it.
        Figures one = figures, two = figures, all = figures;
        one[i] += by;
        two[i] += by, two[(i + 1) % two.size()] -= by;
        for (size_t j = 0; j <= i; ++j) all[j] += by;
        better |= tries(one);
        if (figures.size() > 1) better |= tries(two) || tries(all);
      }
    }
    if (!better) step /= 2;
  }
  return figures;
}

void Judge(const std::vector<MeasuredDecay>& decays, size_t figure_count, DampingLaw& law) {
  std::vector<double> deviations;
  double sum = 0, weights = 0;
  for (const MeasuredDecay& decay : decays) {
    const double deviation = std::abs(Deviation(decay, law));
    deviations.push_back(deviation);
    sum += WeightOf(decay) * deviation;
    weights += WeightOf(decay);
  }
  law.missed_by = std::exp(Median(deviations));
  const auto n = static_cast<double>(decays.size()), k = static_cast<double>(figure_count + 1);
  const double scale = std::max(kExact, sum / weights);
  const double correction = n > k + 1 ? 2 * k * (k + 1) / (n - k - 1) : 1e3 * k;
  law.criterion = 2 * n * std::log(scale) + 2 * k + correction;
}

/// The material's part of the decay rates as a loss factor, of which the median is a first guess.
double MedianLossFactor(const std::vector<MeasuredDecay>& decays) {
  std::vector<double> factors;
  for (const MeasuredDecay& decay : decays) {
    const double own =
        std::max(decay.decay_per_s - decay.radiation_per_s, 0.05 * decay.decay_per_s);
    factors.push_back(own / (std::numbers::pi * decay.frequency_hz));
  }
  return Median(factors);
}

/// Frequencies of a table's points, at which the modes are divided evenly.
std::vector<double> KnotsOf(const std::vector<MeasuredDecay>& decays, size_t count) {
  std::vector<double> frequencies, knots;
  for (const MeasuredDecay& decay : decays) frequencies.push_back(decay.frequency_hz);
  std::ranges::sort(frequencies);
  for (size_t k = 0; k < count; ++k) {
    const double at = static_cast<double>(k * (frequencies.size() - 1)) /
                      static_cast<double>(std::max<size_t>(1, count - 1));
    const auto below = static_cast<size_t>(at);
    const size_t above = std::min(below + 1, frequencies.size() - 1);
    const double part = at - static_cast<double>(below);
    knots.push_back(frequencies[below] * std::pow(frequencies[above] / frequencies[below], part));
  }
  return knots;
}

DampingLaw FitTable(const std::vector<MeasuredDecay>& decays, size_t points) {
  const std::vector<double> knots = KnotsOf(decays, points);
  const MakeLaw make = [&](const Figures& figures) {
    DampingLaw law{.kind = points == 1 ? DampingKind::kEta : DampingKind::kTable};
    for (size_t k = 0; k < points; ++k) {
      law.loss_factor.push_back({knots[k], std::clamp(std::exp(figures[k]), 1e-9, 1.9)});
    }
    return law;
  };
  const Figures start(points, std::log(MedianLossFactor(decays)));
  DampingLaw law = make(Minimize(decays, start, make));
  Judge(decays, points, law);
  return law;
}

DampingLaw FitRayleigh(const std::vector<MeasuredDecay>& decays) {
  const MakeLaw make = [](const Figures& figures) {
    return DampingLaw{.kind = DampingKind::kRayleigh,
                      .alpha1_s = std::exp(figures[0]),
                      .alpha2_per_s = std::exp(figures[1])};
  };
  std::vector<double> frequencies;
  frequencies.reserve(decays.size());
  for (const MeasuredDecay& decay : decays) frequencies.push_back(decay.frequency_hz);
  const double omega = 2 * std::numbers::pi * Median(frequencies);
  const double eta = MedianLossFactor(decays);
  DampingLaw best;
  double least = 0;
  // From either term alone and from both halves.
  for (const double part : {0.5, 0.02, 0.98}) {
    const Figures start = {std::log(part * eta / omega), std::log((1 - part) * eta * omega)};
    DampingLaw law = make(Minimize(decays, start, make));
    const double loss = Loss(decays, law);
    if (part == 0.5 || loss < least) best = law, least = loss;
  }
  Judge(decays, 2, best);
  return best;
}

}  // namespace

double DampingLaw::DecayPerS(double frequency_hz) const {
  const double omega = 2 * std::numbers::pi * frequency_hz;
  return (alpha1_s * omega * omega + alpha2_per_s +
          LossFactorAt(loss_factor, frequency_hz) * omega) /
         2;
}

std::string DampingLaw::Name() const {
  if (kind == DampingKind::kRayleigh) return "Rayleigh";
  if (kind == DampingKind::kEta) return "constant loss factor";
  return absl::StrCat("loss factor at ", loss_factor.size(), " frequencies");
}

std::vector<DampingLaw> FitDamping(const std::vector<MeasuredDecay>& decays, DampingKind kind) {
  std::vector<DampingLaw> laws;
  if (decays.empty()) return laws;
  const auto wants = [&](DampingKind one) { return kind == one || kind == DampingKind::kAuto; };
  if (wants(DampingKind::kEta)) laws.push_back(FitTable(decays, 1));
  if (wants(DampingKind::kRayleigh) && decays.size() >= 2) laws.push_back(FitRayleigh(decays));
  if (wants(DampingKind::kTable)) {
    for (const size_t points : {size_t{2}, size_t{3}, size_t{5}}) {
      if (decays.size() >= points) laws.push_back(FitTable(decays, points));
    }
  }
  std::ranges::sort(laws, {}, &DampingLaw::criterion);
  return laws;
}

}  // namespace carillon::fit
