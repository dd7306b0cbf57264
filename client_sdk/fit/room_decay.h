// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace carillon::fit {

/// How a room answers: its impulse response has, beside the direct sound, noise that decays.
struct Room {
  double decay_per_s = 0;  ///< ln(1000) over the reverberation time
  double share = 0;        ///< usual energy of the tail over that of the direct sound; 0: no room
};

/// A mode in a band. The frequency is relative to the band's centre.
struct BandMode {
  double frequency_hz;
  double decay_per_s;
  double decay_error_per_s = 0;
  size_t index = 0;  ///< of the caller
};

/// The rings of a body in one band.
struct BandRings {
  struct Ring {
    std::vector<std::complex<double>> samples;  ///< from the onset on
    double rate_hz;
    double noise;  ///< mean |x|^2
  };
  std::vector<Ring> rings;
  std::vector<BandMode> modes;
};

/// Finds the room that explains the rings best, or none where a room is not borne out. The decays
/// of the modes may be biased by the room.
///
/// Each mode k of pole p_k is heard as a_k exp(p_k t) + x_k, with dx_k = p_k x_k dt + |a_k| q^(1/2)
/// exp(-d_room t) dW, because the room's tail is noise of the power q exp(-2 d_room t) that the
/// mode is convolved with. The level q is found for each mode and ring by itself. The likelihood of
/// a band follows from a Kalman filter.
Room FindRoom(std::vector<BandRings> bands);

/// Changes frequencies and decays of the modes to the most likely ones in the room, and gives the
/// standard errors of the decays.
void RefineInRoom(const Room& room, BandRings& band);

}  // namespace carillon::fit
