// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <functional>
#include <vector>

#include "client_sdk/fit/recording.h"
#include "client_sdk/fit/room_decay.h"

namespace carillon::fit {

/// A line of a recording: a damped oscillation a exp(-d t) cos(2 pi f t + phase).
struct MeasuredMode {
  double frequency_hz = 0;
  double frequency_error_hz = 0;  ///< standard error
  double decay_per_s = 0;         ///< may be slightly negative for a mode that hardly decays
  double decay_error_per_s = 0;   ///< standard error
  double heard_hz = 0;            ///< the frequency that is heard, before the room is told apart
  double heard_decay_per_s = 0;   ///< the decay rate that is heard
  double level_db = 0;            ///< amplitude at the blow, against the strongest mode
  bool near_room = false;         ///< it decays about as fast as the room
  double signal_to_noise_db = 0;  ///< energy against that of the noise in the mode's own band
  /// Amplitude at the onset of each ring, at which its phase is that of a cosine; zero where the
  /// mode does not stand out.
  std::vector<std::complex<double>> amplitudes = {};
};

/// The modes of a body, and the room in which it was recorded.
struct ExtractedModes {
  std::vector<MeasuredMode> modes;
  Room room;
  /// By how much the noise between the lines is quieter after the blows than before them, dB: an
  /// automatic gain control turned the level down, or a reduction of noise does, and the decays
  /// are not the body's. Zero where it is not.
  double gain_fall_db = 0;
};

/// Is told how much is done, 0 to 1.
using Progress = std::function<void(double)>;

/// Finds the modes of a struck body in its rings, in order of their frequencies, up to 22 kHz.
///
/// Bands of 400 Hz are cut from the sounds. In each, ESPRIT finds poles for 18 model orders, three
/// starts and two lengths of the window; a pole that is stable over 40 % of these is a mode, with
/// the medians of its frequencies and decay rates. The window ends where the noise begins. Poles by
/// which the reverberation of a room surrounds a mode are left out: within 0.8 % of a mode only the
/// best-determined line is kept, or two if both are sharp.
///
/// If at least two rings bear out a room, it is told apart: frequencies and decays are then the
/// most likely ones in that room; see FindRoom.
ExtractedModes ExtractModes(const std::vector<Ring>& rings, const Progress& progress);

}  // namespace carillon::fit
