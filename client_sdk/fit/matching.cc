// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "proto/cpp/poisson_change.h"

namespace carillon::fit {
namespace {

constexpr double kPriorNu = 0.28, kPriorNuError = 0.10;
constexpr double kLeastNu = 0.0, kMostNu = 0.48, kNuStep = 0.02;
/// In the logarithm of the speed.
constexpr double kSpeedStep = 0.002;
/// Relative scatters of the lines about the model, of which each is as likely beforehand; that of
/// the wide tail, and the tail's part.
constexpr std::array<double, 3> kScatters = {0.0015, 0.003, 0.006};
constexpr double kTailScatter = 0.02, kTailPart = 0.15;
/// Part of the modes that are measured, and of the measured lines that are no modes.
constexpr double kSeen = 0.7, kFalse = 0.3;
/// The measured band reaches this far beyond its outermost lines, in the logarithm.
constexpr double kBelowBand = 0.04, kAboveBand = 0.02;
/// The density of modes above those of the model is that of its uppermost ones, in this range.
constexpr double kUppermost = 0.3;
/// Farther away a line and a mode are not the same.
constexpr double kFarthest = 0.015;
/// A line that is 10 dB weaker than another one near the same mode is matched to the mode only if
/// it is nearer by more than this.
constexpr double kPerTenDb = 1e-3;
/// Deviations above which the loss grows linearly.
constexpr double kSoft = 0.002;
constexpr size_t kMostMatches = 8, kPeaks = 24;
constexpr double kDistinct = 0.01;
constexpr int kRounds = 12, kDraws = 200;
/// Standard error of the estimated errors of a mesh, by which the modes are lowered, relative to
/// them; it is common to all modes.
constexpr double kMeshError = 0.15;

/// The lines of one body in the logarithm, for one nu.
struct LogLines {
  std::vector<double> at_unit_speed;  ///< ascending
  double complete_to;
};

LogLines LinesAt(const ModelLines& lines, double nu) {
  LogLines result;
  for (size_t j = 0; j < lines.eigenvalues.size(); ++j) {
    result.at_unit_speed.push_back(std::log(lines.HertzAtUnitSpeed(j, nu)));
  }
  result.complete_to = result.at_unit_speed.back() + 1e-9;
  if (lines.complete_to_eigenvalue > 0) {
    const double hz = std::sqrt(lines.complete_to_eigenvalue) / (2 * std::numbers::pi);
    result.complete_to = std::max(result.complete_to, std::log(hz));
  }
  std::ranges::sort(result.at_unit_speed);
  return result;
}

double Normal(double deviation, double scatter) {
  const double x = deviation / scatter;
  return std::exp(-x * x / 2) / (scatter * std::sqrt(2 * std::numbers::pi));
}

/// Returns the log likelihood of a body's lines, against lines that no body explains. `deviations`
/// has, for each line, how far it is from the one mode that it is matched to, or nothing; if it is
/// null, all modes near a line may explain it, and others, too.
double BodyScore(const std::vector<double>& measured, const LogLines& lines, double log_speed,
                 const std::vector<std::optional<double>>* deviations) {
  const double low = measured.front() - kBelowBand, high = measured.back() + kAboveBand;
  const double width = high - low;
  const double all_false = static_cast<double>(measured.size()) / width;
  const double background = std::max(1.0, kFalse * static_cast<double>(measured.size())) / width;
  const auto& own = lines.at_unit_speed;
  const double complete_to = lines.complete_to + log_speed;
  const auto position = [&](double log_hz) {
    return std::ranges::lower_bound(own, log_hz - log_speed) - own.begin();
  };
  const double uppermost =
      static_cast<double>(position(complete_to) - position(complete_to - kUppermost)) / kUppermost;
  const double beyond = std::max(0.0, high - std::max(low, complete_to));
  double expected = kSeen * static_cast<double>(position(high) - position(low)) +
                    kSeen * uppermost * beyond + background * width;
  std::array<double, kScatters.size()> scores = {};
  for (size_t i = 0; i < measured.size(); ++i) {
    const double log_hz = measured[i];
    double elsewhere = background, tails = 0;
    std::array<double, kScatters.size()> near = {};
    if (log_hz > complete_to) elsewhere += kSeen * uppermost;
    const auto add = [&](double deviation) {
      tails += Normal(deviation, kTailScatter);
      for (size_t s = 0; s < near.size(); ++s) near[s] += Normal(deviation, kScatters[s]);
    };
    if (deviations != nullptr) {
      if ((*deviations)[i]) add(*(*deviations)[i]);
    } else {
      for (auto j = position(log_hz - 4 * kTailScatter);
           j < std::ssize(own) &&
           own[static_cast<size_t>(j)] + log_speed < log_hz + 4 * kTailScatter;
           ++j) {
        add(log_hz - own[static_cast<size_t>(j)] - log_speed);
      }
    }
    for (size_t s = 0; s < near.size(); ++s) {
      const double modes = (1 - kTailPart) * near[s] + kTailPart * tails;
      scores[s] += std::log((elsewhere + kSeen * modes) / all_false);
    }
  }
  const double most = *std::ranges::max_element(scores);
  double mean = 0;
  for (const double score : scores) mean += std::exp(score - most) / kScatters.size();
  return most + std::log(mean) - (expected - all_false * width);
}

double PriorOf(double nu, const MatchSettings& settings) {
  if (settings.poisson_ratio) return 0;
  const double x = (nu - kPriorNu) / kPriorNuError;
  return -x * x / 2;
}

/// The matching of some bodies.
class Matcher {
 public:
  Matcher(const std::vector<MeasuredBody>& bodies, const MatchSettings& settings)
      : bodies_(bodies), settings_(settings) {
    for (const MeasuredBody& body : bodies) {
      std::vector<double>& logs = measured_.emplace_back();
      for (const double hz : body.frequencies_hz) logs.push_back(std::log(hz));
    }
  }

  /// The greatest values over the grid, the greatest first, not near each other.
  std::vector<Match> Peaks() const {
    std::vector<Match> cells;
    const double first = settings_.poisson_ratio.value_or(kLeastNu);
    const double last = settings_.poisson_ratio.value_or(kMostNu);
    for (double nu = first; nu <= last + 1e-9; nu += kNuStep) {
      const std::vector<LogLines> lines = AllLinesAt(nu);
      for (double log_speed = std::log(settings_.least_speed_m_per_s);
           log_speed <= std::log(settings_.most_speed_m_per_s); log_speed += kSpeedStep) {
        cells.push_back({.speed_m_per_s = std::exp(log_speed),
                         .poisson_ratio = nu,
                         .score = Score(lines, log_speed, nu),
                         .lines = {}});
      }
    }
    std::ranges::sort(cells, std::greater(), &Match::score);
    std::vector<Match> peaks;
    for (const Match& cell : cells) {
      if (peaks.size() < kPeaks && IsDistinct(cell, peaks, kDistinct / 2)) peaks.push_back(cell);
    }
    return peaks;
  }

  static bool IsDistinct(const Match& match, const std::vector<Match>& others, double apart) {
    return std::ranges::none_of(others, [&](const Match& other) {
      return std::abs(std::log(match.speed_m_per_s / other.speed_m_per_s)) < apart;
    });
  }

  void Refine(Match& match) const {
    for (int round = 0; round < kRounds; ++round) {
      Assign(match);
      if (match.lines.empty()) break;
      Step(match);
    }
    Assign(match);
    double sum = 0;
    for (const MatchedLine& line : match.lines) sum += line.deviation * line.deviation;
    match.rms = match.lines.empty() ? 0 : std::sqrt(sum / static_cast<double>(match.lines.size()));
    match.score = MatchedScore(match);
  }

  void FindErrors(Match& match) const {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::uniform_int_distribution<size_t> pick(0, match.lines.size() - 1);
    double speed = 0, speed_squares = 0, nu = 0, nu_squares = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      Match moved = match;
      const double mesh = kMeshError * normal(random);
      for (MatchedLine& line : moved.lines) {
        line = match.lines[pick(random)];
        const MeasuredBody& body = bodies_[line.body];
        if (!body.lines.errors.empty()) line.deviation += mesh * body.lines.errors[line.mode];
        line.deviation += normal(random) * body.frequency_errors_hz[line.measured] /
                          body.frequencies_hz[line.measured];
      }
      for (int round = 0; round < 2; ++round) Step(moved, normal(random) * kPriorNuError);
      const double log_speed = std::log(moved.speed_m_per_s / match.speed_m_per_s);
      const double step = moved.poisson_ratio - match.poisson_ratio;
      speed += log_speed, speed_squares += log_speed * log_speed;
      nu += step, nu_squares += step * step;
    }
    const auto deviation = [](double sum, double squares) {
      return std::sqrt(std::max(0.0, squares / kDraws - sum * sum / kDraws / kDraws));
    };
    match.speed_error = deviation(speed, speed_squares);
    match.poisson_error = deviation(nu, nu_squares);
  }

 private:
  std::vector<LogLines> AllLinesAt(double nu) const {
    std::vector<LogLines> lines;
    for (const MeasuredBody& body : bodies_) lines.push_back(LinesAt(body.lines, nu));
    return lines;
  }

  double Score(const std::vector<LogLines>& lines, double log_speed, double nu) const {
    double score = PriorOf(nu, settings_);
    for (size_t b = 0; b < bodies_.size(); ++b) {
      if (!measured_[b].empty()) score += BodyScore(measured_[b], lines[b], log_speed, nullptr);
    }
    return score;
  }

  /// The score with each line matched to one mode at most.
  double MatchedScore(const Match& match) const {
    const std::vector<LogLines> lines = AllLinesAt(match.poisson_ratio);
    const double log_speed = std::log(match.speed_m_per_s);
    double score = PriorOf(match.poisson_ratio, settings_);
    for (size_t b = 0; b < bodies_.size(); ++b) {
      std::vector<std::optional<double>> deviations(measured_[b].size());
      for (const MatchedLine& line : match.lines) {
        if (line.body == b) deviations[line.measured] = line.deviation;
      }
      if (!measured_[b].empty()) score += BodyScore(measured_[b], lines[b], log_speed, &deviations);
    }
    return score;
  }

  /// Matches each line to one mode, the nearest and the loudest pairs first.
  void Assign(Match& match) const {
    match.lines.clear();
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const ModelLines& model = bodies_[b].lines;
      std::vector<MatchedLine> pairs;
      for (size_t j = 0; j < model.eigenvalues.size(); ++j) {
        const double log_hz =
            std::log(match.speed_m_per_s * model.HertzAtUnitSpeed(j, match.poisson_ratio));
        for (size_t i = 0; i < measured_[b].size(); ++i) {
          const double deviation = measured_[b][i] - log_hz;
          if (std::abs(deviation) < kFarthest) pairs.push_back({b, i, j, deviation});
        }
      }
      const std::vector<double>& levels_db = bodies_[b].levels_db;
      std::ranges::sort(pairs, {}, [&](const MatchedLine& pair) {
        const double level_db = levels_db.empty() ? 0 : levels_db[pair.measured];
        return std::abs(pair.deviation) - kPerTenDb * level_db / 10;
      });
      std::vector<bool> line_taken(measured_[b].size()), mode_taken(model.eigenvalues.size());
      for (const MatchedLine& pair : pairs) {
        if (line_taken[pair.measured] || mode_taken[pair.mode]) continue;
        line_taken[pair.measured] = mode_taken[pair.mode] = true;
        match.lines.push_back(pair);
      }
    }
  }

  /// One step of Gauss and Newton on the lines as they are matched. Their deviations follow.
  void Step(Match& match, double prior_shift = 0) const {
    double cc = 0, cn = 0, nn = 0, rc = 0, rn = 0;
    for (const MatchedLine& line : match.lines) {
      const double slope = LogSlope(line, match.poisson_ratio);
      const double x = line.deviation / kSoft;
      const double weight = 1 / (kSoft * kSoft * std::sqrt(1 + x * x));
      cc += weight, cn += weight * slope, nn += weight * slope * slope;
      rc += weight * line.deviation, rn += weight * slope * line.deviation;
    }
    double step_nu = 0;
    if (!settings_.poisson_ratio) {
      const double prior = 1 / (kPriorNuError * kPriorNuError);
      nn += prior;
      rn += prior * (kPriorNu + prior_shift - match.poisson_ratio);
      step_nu = (rn - cn * rc / cc) / (nn - cn * cn / cc);
      const double nu = std::clamp(match.poisson_ratio + step_nu, -0.2, 0.49);
      step_nu = nu - match.poisson_ratio;
    }
    const double step_speed = (rc - cn * step_nu) / cc;
    for (MatchedLine& line : match.lines) {
      line.deviation -= step_speed + LogSlope(line, match.poisson_ratio) * step_nu;
    }
    match.speed_m_per_s *= std::exp(step_speed);
    match.poisson_ratio += step_nu;
  }

  /// d ln f / d nu.
  double LogSlope(const MatchedLine& line, double nu) const {
    const ModelLines& model = bodies_[line.body].lines;
    constexpr double kStep = 1e-4;
    return std::log(model.HertzAtUnitSpeed(line.mode, nu + kStep) /
                    model.HertzAtUnitSpeed(line.mode, nu - kStep)) /
           (2 * kStep);
  }

  const std::vector<MeasuredBody>& bodies_;
  const MatchSettings& settings_;
  std::vector<std::vector<double>> measured_;  ///< logarithms of the frequencies
};

}  // namespace

double ModelLines::HertzAtUnitSpeed(size_t mode, double nu) const {
  const double change = EigenvalueChange(slopes[mode], poisson_ratio, nu);
  const double hz = std::sqrt(eigenvalues[mode] * change) / (2 * std::numbers::pi);
  return errors.empty() ? hz : hz * (1 - std::min(0.5, errors[mode]));
}

std::vector<Match> FindMatches(const std::vector<MeasuredBody>& bodies,
                               const MatchSettings& settings) {
  const Matcher matcher(bodies, settings);
  std::vector<Match> refined = matcher.Peaks(), matches;
  for (Match& match : refined) matcher.Refine(match);
  std::ranges::sort(refined, std::greater(), &Match::score);
  for (Match& match : refined) {
    if (matches.size() < kMostMatches && Matcher::IsDistinct(match, matches, kDistinct)) {
      matches.push_back(std::move(match));
    }
  }
  if (!matches.empty() && !matches[0].lines.empty()) matcher.FindErrors(matches[0]);
  return matches;
}

}  // namespace carillon::fit
