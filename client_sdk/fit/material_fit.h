// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/fit/damping_law.h"
#include "client_sdk/fit/matching.h"
#include "client_sdk/fit/mode_extraction.h"

namespace carillon::fit {

/// Part of the measured lines that must be modes of the body.
inline constexpr double kLeastMatched = 0.35;

/// A body of the material, its modes as computed and as measured.
struct FittedBody {
  std::string name;
  ModelLines lines;
  std::vector<MeasuredMode> modes;  ///< ascending; decays may be zero: unknown
  double volume_m3 = 0;             ///< zero: unknown
  /// #modes or empty: the decay rate of each by radiation, for unit density of the body; it is
  /// inversely proportional to the density.
  std::vector<double> radiation = {};
};

struct FitSettings {
  std::optional<double> mass_kg = {};            ///< of the first body
  std::optional<double> density_kg_per_m3 = {};  ///< if there is no mass
  std::optional<double> poisson_ratio = {};
  /// Range of Young's modulus, Pa.
  std::optional<double> least_young_pa = {}, most_young_pa = {};
  DampingKind damping = DampingKind::kAuto;
};

/// One measured line as the fit explains it.
struct FittedLine {
  size_t body = 0;
  MeasuredMode measured;
  std::optional<size_t> mode;  ///< of the model, from 0; absent: no mode matches
  double model_hz = 0;         ///< frequency of that mode with the material
  double radiation_per_s = 0;
  double law_per_s = 0;        ///< decay rate by the law and radiation
  double law_error_per_s = 0;  ///< its standard error
};

/// A material that was found from recordings.
struct MaterialFit {
  double young_over_density = 0;        ///< m^2/s^2
  double young_over_density_error = 0;  ///< standard error, relative
  double poisson_ratio = 0;
  double poisson_error = 0;  ///< standard error; zero if the ratio was given
  double density_kg_per_m3 = 0;
  double young_pa = 0;
  double rms = 0;  ///< of the relative deviations of the matched frequencies
  double log_odds = 0;
  std::vector<Match> candidates;  ///< of which the first was taken
  /// The laws that were tried, the one that was taken first. There is none if the kind of the law
  /// is not given, and a room or noise hides the decays of most matched lines, or no law explains
  /// them.
  std::vector<DampingLaw> laws;
  /// Standard error of the law that was taken, relative: the median over the matched lines.
  double damping_error = 0;
  /// By what factor the best law misses half of the rates if what the models radiate is not taken
  /// off; zero: there is no law, or nothing is taken off.
  double missed_without_air = 0;
  std::vector<FittedLine> lines;
  size_t matched_count = 0;
  size_t decay_count = 0;                       ///< matched lines whose decay is known
  double decays_from_hz = 0, decays_to_hz = 0;  ///< the lowest and the highest of these
};

/// Fits one material to all bodies. Errors: InvalidArgument (TOO_FEW_MODES, MATCH_AMBIGUOUS,
/// MESH_DISAGREES, and INVALID_MATERIAL without mass and density).
absl::StatusOr<MaterialFit> FitMaterial(const std::vector<FittedBody>& bodies,
                                        const FitSettings& settings);

/// Returns whether the rings hold modes enough, or why not. Errors: InvalidArgument (TOO_FEW_MODES,
/// RECORDING_TOO_NOISY).
absl::Status CheckModes(const std::vector<Ring>& rings, const std::vector<MeasuredMode>& modes);

}  // namespace carillon::fit
