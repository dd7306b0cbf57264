// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace carillon::fit {

/// The modes of a model as functions of the material, f_j = c g_j(nu) with c = sqrt(E/rho).
struct ModelLines {
  double poisson_ratio = 0;  ///< with which the modes were computed
  std::vector<double> eigenvalues =
      {};                           ///< #modes, ascending, for c = 1 m/s and the size that sounded
  std::vector<double> errors = {};  ///< #modes: how much too high each frequency is, relative
  std::vector<double> slopes = {};  ///< #modes: d ln Lambda / d nu
  double complete_to_eigenvalue = 0;  ///< all modes up to here are there

  /// g_j(nu), Hz for each m/s; see EigenvalueChange.
  double HertzAtUnitSpeed(size_t mode, double nu) const;
};

/// A body, and the frequencies that were measured on it.
struct MeasuredBody {
  ModelLines lines = {};
  std::vector<double> frequencies_hz = {};       ///< ascending
  std::vector<double> frequency_errors_hz = {};  ///< standard errors
  std::vector<double> levels_db = {};            ///< against the strongest; empty: all alike
};

/// The properties of the material that are known beforehand.
struct MatchSettings {
  double least_speed_m_per_s = 900;  ///< of sqrt(E/rho)
  double most_speed_m_per_s = 7500;
  std::optional<double> poisson_ratio = {};  ///< absent: 0.28 +- 0.10
};

/// A measured line and the mode that makes it.
struct MatchedLine {
  size_t body, measured, mode;
  double deviation;  ///< ln of the measured frequency over that of the mode
};

/// One way to match the lines.
struct Match {
  double speed_m_per_s = 0;
  double poisson_ratio = 0;
  /// Log likelihood of the measured lines, against lines that no body explains.
  double score = 0;
  std::vector<MatchedLine> lines = {};
  double rms = 0;            ///< of the deviations
  double speed_error = 0;    ///< standard error, relative; see FindMatches
  double poisson_error = 0;  ///< standard error
};

/// Returns the best ways to match lines of one material, the best first, at most eight, of which no
/// two have speeds within a percent. The log odds of the first are its score less that
/// of the second.
///
/// The measured lines are a Poisson process with the density rho_0 + sum_j p N(ln f; ln f_j,
/// delta), delta = 0.15, 0.3 or 0.6 % with a wide tail, so that missing and false lines cost
/// little, predictions that nothing bears out do cost, and lines that are near tell the more. The
/// greatest values over a grid of c and nu are refined by matching each line to one mode, and least
/// squares with a soft L1 loss. The errors of the first are those of a bootstrap over the matched
/// lines, each moved by its error, and all by the doubt about the estimated errors of the mesh.
std::vector<Match> FindMatches(const std::vector<MeasuredBody>& bodies,
                               const MatchSettings& settings);

}  // namespace carillon::fit
