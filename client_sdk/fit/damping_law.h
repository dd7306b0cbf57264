// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "proto/cpp/loss_factor.h"

namespace carillon::fit {

/// The decay of one mode.
struct MeasuredDecay {
  double frequency_hz = 0;
  double decay_per_s = 0;      ///< above zero
  double relative_error = 0;   ///< standard error
  double radiation_per_s = 0;  ///< the part of it that the body radiates, if that is known
};

enum class DampingKind { kAuto, kEta, kTable, kRayleigh };

/// A law of the decay of modes by their material, d = (alpha1 omega^2 + alpha2 + eta omega)/2.
struct DampingLaw {
  DampingKind kind = DampingKind::kEta;
  double alpha1_s = 0;
  double alpha2_per_s = 0;
  std::vector<LossFactorPoint> loss_factor = {};
  double missed_by = 1;  ///< median factor by which the law, with radiation, misses a decay rate
  double criterion = 0;  ///< Akaike's, corrected for few modes, with the noise of Laplace

  double DecayPerS(double frequency_hz) const;
  std::string Name() const;
};

/// Returns the laws of a kind, or of all kinds, that fit decays of at least one mode, the best by
/// Akaike's criterion first: a constant loss factor, Rayleigh's law, and tables of a loss factor of
/// three and five points. Each has the least mean |ln d - ln (d_law + d_radiation)|, in which modes
/// count by their errors. A law of too many figures for the modes is left out, unless it is asked
/// for.
std::vector<DampingLaw> FitDamping(const std::vector<MeasuredDecay>& decays, DampingKind kind);

/// Returns the standard error of ln d of the first of the laws that FitDamping found, at each
/// frequency. It is that of a bootstrap over the decays, each moved by its error, in which the
/// other laws are drawn by their Akaike weights (Burnham and Anderson, Model selection and
/// multimodel inference, 2002), and grows with the distance from the decays.
std::vector<double> LawErrors(const std::vector<MeasuredDecay>& decays,
                              const std::vector<DampingLaw>& laws,
                              const std::vector<double>& frequencies_hz);

}  // namespace carillon::fit
