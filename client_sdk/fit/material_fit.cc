// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/material_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/fit/statistics.h"
#include "proto/cpp/error_reason.h"

namespace carillon::fit {
namespace {

constexpr size_t kFewestModes = 5;
constexpr double kLeastLogOdds = 4;
/// The meshes of other bodies match by chance, but then they leave half of the lines or more, so
/// that the log odds must be the greater, the larger the part of the lines that no mode explains.
constexpr double kLogOddsPerUnmatched = 5;
constexpr double kMostRms = 0.01;
/// Decays that are known worse than this do not count.
constexpr double kMostDecayError = 0.45;
/// Part of the matched lines whose decay must be known for a law that is not given.
constexpr double kLeastDecays = 0.5;
/// What else a recording has, against its strongest line: it moves the decays of weak lines.
constexpr double kElse = 1e-3;
constexpr double kLeastLoudness_db = 20;
/// Strikes that are cut sooner than this have few lines because of that.
constexpr double kLeastStrike_s = 0.2;
/// Densities of solid bodies, from light foams to osmium: g/cm^3 in place of kg/m^3 are below.
constexpr double kLeastDensity = 25, kMostDensity = 25'000;
/// No law is taken that misses half of the decay rates by a greater factor.
constexpr double kMostMissed = 3;

absl::Status TooFew(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "TOO_FEW_MODES",
                 absl::StrCat(what, ", and a material needs at least ", kFewestModes,
                              ": strike with something hard and light, such as a spoon, at three "
                              "places, and hang the body by a thread so that it rings"));
}

absl::StatusOr<double> Believable(double density, absl::string_view where,
                                  absl::string_view repair) {
  if (density >= kLeastDensity && density <= kMostDensity) return density;
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrFormat("the density%s is %.3g kg/m^3, and no solid body's is: give %s",
                                 where, density, repair));
}

absl::StatusOr<double> DensityOf(const FittedBody& first, const FitSettings& settings) {
  if (settings.mass_kg && first.volume_m3 > 0) {
    return Believable(
        *settings.mass_kg / first.volume_m3,
        absl::StrFormat(", the mass over the model's volume of %.4g cm^3,", first.volume_m3 * 1e6),
        "the mass in kg, or make the model with the unit of its mesh (--unit)");
  }
  if (settings.density_kg_per_m3) {
    return Believable(*settings.density_kg_per_m3, "", "the density in kg/m^3");
  }
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrCat("frequencies give only Young's modulus divided by the density",
                              settings.mass_kg ? ", and the volume of the model is unknown: give "
                                                 "the density"
                                               : ": give the mass of the body, or the density"));
}

MatchSettings SettingsOf(const FitSettings& settings, double density) {
  MatchSettings result{.poisson_ratio = settings.poisson_ratio};
  if (settings.least_young_pa)
    result.least_speed_m_per_s = std::sqrt(*settings.least_young_pa / density);
  if (settings.most_young_pa)
    result.most_speed_m_per_s = std::sqrt(*settings.most_young_pa / density);
  return result;
}

MeasuredBody Measured(const FittedBody& body) {
  MeasuredBody measured{.lines = body.lines};
  for (const MeasuredMode& mode : body.modes) {
    measured.frequencies_hz.push_back(mode.frequency_hz);
    measured.frequency_errors_hz.push_back(mode.frequency_error_hz);
    measured.levels_db.push_back(mode.level_db);
  }
  return measured;
}

std::string Candidates(const std::vector<Match>& matches, double density) {
  std::string text;
  for (const Match& match : matches) {
    if (match.score < matches[0].score - 3 * kLeastLogOdds) break;
    const double speed = match.speed_m_per_s;
    absl::StrAppendFormat(
        &text,
        "%sE %.4g GPa with Poisson's ratio %.3f (%d lines, %.2f %% apart, %.1f nepers behind)",
        text.empty() ? "" : "; ", speed * speed * density / 1e9, match.poisson_ratio,
        match.lines.size(), 100 * match.rms, matches[0].score - match.score);
  }
  return text;
}

absl::Status Check(const std::vector<Match>& matches, size_t line_count, double density) {
  const Match& best = matches[0];
  if (best.lines.size() < kFewestModes) {
    return TooFew(
        absl::StrFormat("%d of %d lines match modes of the model", best.lines.size(), line_count));
  }
  // The null hypothesis, by which no line is a mode of the body, is a rival, too.
  const double second = std::max(0.0, matches.size() > 1 ? matches[1].score : 0.0);
  const double odds = best.score - second;
  if (odds < kLeastLogOdds && second > 0) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MATCH_AMBIGUOUS",
        absl::StrCat(
            "the lines fit the model in several ways: ", Candidates(matches, density),
            ". Record strikes at more places, give the Poisson's ratio or a range of Young's "
            "modulus if they are known, and see that the mesh is that of the body"));
  }
  const double matched = static_cast<double>(best.lines.size()) / static_cast<double>(line_count);
  const double least = kLeastLogOdds + kLogOddsPerUnmatched * (1 - matched);
  if (odds < least || best.rms > kMostRms || matched < kLeastMatched) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_DISAGREES",
        absl::StrFormat(
            "%d of %d lines match, %.2f %% apart, which a wrong mesh reaches by chance. Measure "
            "the body again, above all its thickness, and make a model of the right mesh; see "
            "that all recordings are of this body and not clipped; or record strikes at more "
            "places",
            best.lines.size(), line_count, 100 * best.rms));
  }
  return absl::OkStatus();
}

std::vector<FittedLine> LinesOf(const std::vector<FittedBody>& bodies, const Match& match,
                                double density) {
  std::vector<FittedLine> lines;
  for (size_t b = 0; b < bodies.size(); ++b) {
    const size_t first = lines.size();
    for (const MeasuredMode& mode : bodies[b].modes)
      lines.push_back({.body = b, .measured = mode, .mode = {}});
    for (const MatchedLine& matched : match.lines) {
      if (matched.body != b) continue;
      FittedLine& line = lines[first + matched.measured];
      line.mode = matched.mode;
      line.model_hz =
          match.speed_m_per_s * bodies[b].lines.HertzAtUnitSpeed(matched.mode, match.poisson_ratio);
      if (!bodies[b].radiation.empty())
        line.radiation_per_s = bodies[b].radiation[matched.mode] / density;
    }
  }
  return lines;
}

std::vector<MeasuredDecay> DecaysOf(const std::vector<FittedLine>& lines) {
  std::vector<MeasuredDecay> decays;
  for (const FittedLine& line : lines) {
    const double decay = line.measured.decay_per_s;
    if (!line.mode || !(decay > 0)) continue;
    const double error = std::hypot(line.measured.decay_error_per_s / decay,
                                    kElse * std::pow(10, -line.measured.level_db / 20));
    if (error > kMostDecayError) continue;
    decays.push_back({.frequency_hz = line.measured.frequency_hz,
                      .decay_per_s = decay,
                      .relative_error = error,
                      .radiation_per_s = line.radiation_per_s});
  }
  return decays;
}

/// Sets the decay rates of the matched lines by the law that was taken, and their errors.
void ApplyLaw(const std::vector<MeasuredDecay>& decays, MaterialFit& fit) {
  std::vector<double> frequencies_hz;
  for (const FittedLine& line : fit.lines) frequencies_hz.push_back(line.measured.frequency_hz);
  const std::vector<double> errors = LawErrors(decays, fit.laws, frequencies_hz);
  std::vector<double> matched;
  for (size_t k = 0; k < fit.lines.size(); ++k) {
    FittedLine& line = fit.lines[k];
    if (!line.mode) continue;
    const double material_per_s = fit.laws[0].DecayPerS(line.measured.frequency_hz);
    line.law_per_s = material_per_s + line.radiation_per_s;
    line.law_error_per_s = errors[k] * material_per_s;
    matched.push_back(errors[k]);
  }
  fit.damping_error = Median(std::move(matched));
}

double MissedWithoutAir(std::vector<MeasuredDecay> decays, DampingKind kind) {
  double air_per_s = 0;
  for (MeasuredDecay& decay : decays) air_per_s += std::exchange(decay.radiation_per_s, 0);
  if (air_per_s == 0) return 0;
  const std::vector<DampingLaw> laws = FitDamping(decays, kind);
  return laws.empty() ? 0 : laws[0].missed_by;
}

}  // namespace

absl::StatusOr<MaterialFit> FitMaterial(const std::vector<FittedBody>& bodies,
                                        const FitSettings& settings) {
  const absl::StatusOr<double> density = DensityOf(bodies.front(), settings);
  if (!density.ok()) return density.status();
  std::vector<MeasuredBody> measured;
  size_t line_count = 0;
  for (const FittedBody& body : bodies) {
    measured.push_back(Measured(body));
    line_count += body.modes.size();
  }
  if (line_count < kFewestModes) return TooFew(absl::StrFormat("there are %d lines", line_count));
  MaterialFit fit;
  fit.candidates = FindMatches(measured, SettingsOf(settings, *density));
  if (fit.candidates.empty()) return TooFew("no line matches a mode of the model");
  if (absl::Status status = Check(fit.candidates, line_count, *density); !status.ok())
    return status;
  const Match& match = fit.candidates[0];
  fit.young_over_density = match.speed_m_per_s * match.speed_m_per_s;
  fit.young_over_density_error = 2 * match.speed_error;
  fit.poisson_ratio = match.poisson_ratio;
  fit.poisson_error = settings.poisson_ratio ? 0 : match.poisson_error;
  fit.density_kg_per_m3 = *density;
  fit.young_pa = fit.young_over_density * *density;
  fit.rms = match.rms;
  fit.matched_count = match.lines.size();
  fit.log_odds =
      match.score - std::max(0.0, fit.candidates.size() > 1 ? fit.candidates[1].score : 0.0);
  fit.lines = LinesOf(bodies, match, *density);
  const std::vector<MeasuredDecay> decays = DecaysOf(fit.lines);
  fit.decay_count = decays.size();
  if (!decays.empty()) {
    const auto [lowest, highest] = std::ranges::minmax(decays, {}, &MeasuredDecay::frequency_hz);
    fit.decays_from_hz = lowest.frequency_hz, fit.decays_to_hz = highest.frequency_hz;
  }
  const auto heard = std::ranges::count_if(
      fit.lines, [](const FittedLine& line) { return line.mode && line.measured.decay_per_s > 0; });
  const bool known =
      static_cast<double>(decays.size()) >= kLeastDecays * static_cast<double>(heard);
  if (known || settings.damping != DampingKind::kAuto) {
    fit.laws = FitDamping(decays, settings.damping);
  }
  if (settings.damping == DampingKind::kAuto && !fit.laws.empty() &&
      fit.laws[0].missed_by > kMostMissed) {
    fit.laws.clear();
  }
  if (fit.laws.empty()) return fit;
  ApplyLaw(decays, fit);
  fit.missed_without_air = MissedWithoutAir(decays, settings.damping);
  return fit;
}

absl::Status CheckModes(const std::vector<Ring>& rings, const std::vector<MeasuredMode>& modes) {
  if (modes.size() >= kFewestModes) return absl::OkStatus();
  double longest_s = 0;
  for (const Ring& ring : rings) {
    longest_s = std::max(
        longest_s, static_cast<double>(ring.samples.size() - ring.onset) / ring.sample_rate_hz);
  }
  if (longest_s < kLeastStrike_s) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "TOO_FEW_MODES",
        rings.empty()
            ? "the recordings have no strike: they are silent, or end within 0.05 s of it; record "
              "a second or two of each strike"
            : absl::StrFormat("the recordings end %.2g s after the strike, and %d lines stand out: "
                              "record a second or two of each strike",
                              longest_s, modes.size()));
  }
  const double loudness_db = LoudnessDb(rings);
  if (loudness_db < kLeastLoudness_db) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "RECORDING_TOO_NOISY",
        absl::StrFormat(
            "the blows are only %.0f dB above the noise, and %d lines stand out: record in a "
            "quiet room at 10 to 20 cm from the body, without a limiter or noise reduction",
            loudness_db, modes.size()));
  }
  return TooFew(absl::StrFormat("%d lines stand out of %d strikes", modes.size(), rings.size()));
}

}  // namespace carillon::fit
