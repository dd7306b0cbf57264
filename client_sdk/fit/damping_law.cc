// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/damping_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "absl/strings/str_cat.h"
#include "client_sdk/fit/statistics.h"

namespace carillon::fit {
namespace {

/// Below this the deviation of a decay rate is no worse than none: the loss is rounded.
constexpr double kRounded = 0.03;
/// No law is held to be exacter than this.
constexpr double kExact = 0.01;
constexpr int kMostRounds = 60;
/// Steps of the logarithms of a law's figures: the first of a search from a guess, the first of one
/// that begins near its end, and the last of each.
constexpr double kFar = 1, kNear = 0.1, kFine = 1e-5, kCoarse = 2e-3;
constexpr int kLaws = 100;
/// Part of the variance of decays' errors that they share, as they do in a room.
constexpr double kShared = 0.2;
/// Standard error of a law, in nepers for each octave beyond the decays that it rests on.
constexpr double kPerOctave = 0.2;
/// Part of the draws whose deviation is taken for the standard error, by this many of which a
/// normal one is exceeded in the rest: no wild draw decides.
constexpr double kQuantile = 0.9, kAtQuantile = 1.645;

using Figures = std::vector<double>;  // logarithms

/// The figures of a law that are found: two of Rayleigh's, or the loss factors.
Figures FiguresOf(const DampingLaw& law) {
  if (law.kind == DampingKind::kRayleigh)
    return {std::log(law.alpha1_s), std::log(law.alpha2_per_s)};
  Figures figures;
  for (const LossFactorPoint& point : law.loss_factor)
    figures.push_back(std::log(point.loss_factor));
  return figures;
}

DampingLaw WithFigures(DampingLaw law, const Figures& figures) {
  if (law.kind == DampingKind::kRayleigh) {
    law.alpha1_s = std::exp(figures[0]);
    law.alpha2_per_s = std::exp(figures[1]);
  }
  for (size_t k = 0; k < law.loss_factor.size(); ++k)
    law.loss_factor[k].loss_factor = std::clamp(std::exp(figures[k]), 1e-9, 1.9);
  return law;
}

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

/// Lowers the loss by changing one figure after the other, and all together, by steps that shrink
/// from the first to the last.
DampingLaw Minimize(const std::vector<MeasuredDecay>& decays, const DampingLaw& start,
                    double step = kFar, double last_step = kFine) {
  Figures figures = FiguresOf(start);
  double least = Loss(decays, start);
  const auto tries = [&](const Figures& tried) {
    const double loss = Loss(decays, WithFigures(start, tried));
    if (loss >= least) return false;
    least = loss, figures = tried;
    return true;
  };
  for (int round = 0; round < 40 * kMostRounds && step > last_step; ++round) {
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
  return WithFigures(start, figures);
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
  DampingLaw law{.kind = points == 1 ? DampingKind::kEta : DampingKind::kTable};
  const double loss_factor = std::clamp(MedianLossFactor(decays), 1e-9, 1.9);
  for (const double knot : KnotsOf(decays, points)) law.loss_factor.push_back({knot, loss_factor});
  law = Minimize(decays, law);
  Judge(decays, points, law);
  return law;
}

DampingLaw FitRayleigh(const std::vector<MeasuredDecay>& decays) {
  std::vector<double> frequencies;
  frequencies.reserve(decays.size());
  for (const MeasuredDecay& decay : decays) frequencies.push_back(decay.frequency_hz);
  const double omega = 2 * std::numbers::pi * Median(frequencies);
  const double eta = MedianLossFactor(decays);
  DampingLaw best;
  double least = 0;
  // From either term alone and from both halves.
  for (const double part : {0.5, 0.02, 0.98}) {
    const DampingLaw law = Minimize(decays, {.kind = DampingKind::kRayleigh,
                                             .alpha1_s = part * eta / omega,
                                             .alpha2_per_s = (1 - part) * eta * omega});
    const double loss = Loss(decays, law);
    if (part == 0.5 || loss < least) best = law, least = loss;
  }
  Judge(decays, 2, best);
  return best;
}

/// Picks one of the laws by Akaike's weights.
const DampingLaw& Pick(const std::vector<DampingLaw>& laws, std::mt19937& random) {
  std::vector<double> weights;
  weights.reserve(laws.size());
  for (const DampingLaw& law : laws)
    weights.push_back(std::exp((laws[0].criterion - law.criterion) / 2));
  return laws[std::discrete_distribution<size_t>(weights.begin(), weights.end())(random)];
}

/// Draws the decays anew, each moved by its error.
std::vector<MeasuredDecay> Resampled(const std::vector<MeasuredDecay>& decays,
                                     std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<size_t> pick(0, decays.size() - 1);
  const double shared = std::sqrt(kShared) * normal(random);
  std::vector<MeasuredDecay> drawn;
  for (size_t k = 0; k < decays.size(); ++k) {
    MeasuredDecay decay = decays[pick(random)];
    const double error = shared + std::sqrt(1 - kShared) * normal(random);
    decay.decay_per_s *= std::exp(error * decay.relative_error);
    drawn.push_back(decay);
  }
  return drawn;
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

std::vector<double> LawErrors(const std::vector<MeasuredDecay>& decays,
                              const std::vector<DampingLaw>& laws,
                              const std::vector<double>& frequencies_hz) {
  std::mt19937 random(1);
  std::vector<DampingLaw> drawn;
  for (int draw = 0; draw < kLaws; ++draw) {
    const DampingLaw& law = Pick(laws, random);
    drawn.push_back(Minimize(Resampled(decays, random), law, kNear, kCoarse));
  }
  const auto [low, high] = std::ranges::minmax(decays, {}, &MeasuredDecay::frequency_hz);
  std::vector<double> errors;
  errors.reserve(frequencies_hz.size());
  for (const double hz : frequencies_hz) {
    std::vector<double> deviations;
    deviations.reserve(drawn.size());
    for (const DampingLaw& law : drawn)
      deviations.push_back(std::abs(std::log(law.DecayPerS(hz) / laws[0].DecayPerS(hz))));
    const auto at = deviations.begin() + static_cast<std::ptrdiff_t>(kQuantile * kLaws);
    std::ranges::nth_element(deviations, at);
    const double octaves =
        std::max({0.0, std::log2(low.frequency_hz / hz), std::log2(hz / high.frequency_hz)});
    errors.push_back(std::hypot(*at / kAtQuantile, kPerOctave * octaves));
  }
  return errors;
}

}  // namespace carillon::fit
