// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/synthesis/bank/radiation.h"
#include "server/synthesis/bank/sounding_material.h"

namespace carillon {

/// Criteria for the modes that may sound.
struct SoundingBand {
  double lowest_hz = 20;      ///< natural frequency
  double highest_hz = 20000;  ///< natural frequency; Nyquist bounds it further
  double shortest_t60_s = 0.002;
  /// If more modes qualify, the most audible are kept; see SelectSoundingModes.
  size_t most_modes = 800;
  /// Modes are joined as degenerate (JoinDegenerateModes) if their natural frequencies differ
  /// relatively by no more than this and their couplings by less than a factor of two.
  /// Finite-element meshes split true pairs by up to about 1e-3.
  double pair_tolerance = 2e-3;
  /// If true, degenerate modes radiate in different directions, so each keeps its coupling and
  /// phase; they share only their mean frequency and decay.
  bool directed = false;
};

/// One mode of a body of a given material and size.
struct SoundingMode {
  uint32_t column = 0;  ///< in the modal model
  double natural_frequency_hz = 0;
  double damped_rad_per_s = 0;  ///< omega_d
  double decay_rate_per_s = 0;  ///< sigma, not above zero
  /// The pressure at 1 m is kPascalsPerVolumeVelocity times this coupling times the modal
  /// displacement. It is the paper's c_m, or the coupling that radiates the mode's true power, in
  /// m^2 kg^(-1/2) s^(-1).
  double coupling = 0;
  /// The phase by which the output leads a sine: pi/2 for the second mode of a degenerate pair,
  /// else zero.
  double output_phase_rad = 0;
  /// The number, from 1, of the multiplet of three or more degenerate modes to which the mode
  /// belongs; zero if it belongs to none. Such modes sound as one (Multiplets).
  uint32_t multiplet = 0;
};

/// The modes with which a body sounds.
struct SoundingModes {
  std::vector<SoundingMode> modes;  ///< ascending column
  double shape_scale = 1;           ///< phi = shape_scale * phi of the model
};

/// Returns sqrt(Lambda E / (rho s^2)) / (2 pi), Hz, for an `eigenvalue` Lambda of the model.
double NaturalFrequencyHz(double eigenvalue, const SoundingMaterial& material);

/// Applies material and size to a model's modes, and selects those that sound (docs/physics.md, 2
/// and 3; the paper, 3.4):
///
///   Lambda' = Lambda E/(rho s^2),  sigma = -(alpha1 Lambda' + alpha2 + eta Lambda'^(1/2))/2,
///   omega_d = sqrt(Lambda' - sigma^2),  c' = c E^(1/2) rho^(-1) s^(-1/2)
///
/// with the loss factor eta at the natural frequency (MaterialDecayRatePerS in mode_damping.h). If
/// the radiation is known, with I' = I s/rho,
///
///   sigma' = sigma - rho_air Lambda' I'/(2 c),  c' kPascalsPerVolumeVelocity = rho_air Lambda'
///   (I'/(4 pi))^(1/2)
///
/// so that the mode loses the power W that it radiates, and the pressure at 1 m is that of W
/// radiated equally in all directions. A mode sounds if its natural frequency lies in the band and
/// below Nyquist, sigma^2 < Lambda', and T60 is long enough. Degenerate modes are joined
/// (JoinDegenerateModes), so that loudness does not depend on the direction around a symmetric body
/// in which it is struck. The mesh splits the pair of a chime by about 1e-4; unmerged, the pair
/// would beat over seconds and differ by 2 dB. If more than `most_modes` qualify, the modes with
/// the most A-weighted energy in the first 0.2 s after a unit modal impulse are kept (0.2 s is
/// about the ear's integration time).
SoundingModes SelectSoundingModes(const ModeTable& table, const SoundingMaterial& material,
                                  double sample_rate_hz, const SoundingBand& band = {});

}  // namespace carillon
