// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon::fit {

/// The sound of a struck body, as an audio file has it.
struct Recording {
  std::string name;
  double sample_rate_hz = 0;
  std::vector<std::vector<float>> channels;  ///< #channels by #frames
};

/// Reads an audio file (WAV, AIFF, FLAC, Ogg, MP3). Errors: NotFound (FILE_NOT_FOUND),
/// InvalidArgument (RECORDING_UNREADABLE).
absl::StatusOr<Recording> ReadRecording(const std::string& path);

/// One strike in one channel of a recording.
struct Ring {
  double sample_rate_hz = 0;
  size_t recording = 0;        ///< index of the recording
  size_t channel = 0;          ///< index of the channel
  size_t first_frame = 0;      ///< the frame of the recording with which `samples` begin
  std::vector<float> samples;  ///< a little of what comes before the blow, and the sound after it
  size_t onset = 0;            ///< index into `samples`
};

/// Finds the strikes in each channel. A strike ends where the next one begins, or after 3 s.
std::vector<Ring> FindRings(const std::vector<Recording>& recordings);

/// Returns how long a recording stands at the limits of its level, s; zero if it is not clipped.
double ClippedSeconds(const Recording& recording);

/// Returns by how much the quietest part after the blow is quieter than the quietest before it, dB,
/// in the middle of all rings: more than noise alone varies only if a gate or a reduction of noise
/// turned it down. Zero if no ring has noise before its blow.
double GateFallDb(const std::vector<Ring>& rings);

/// Returns by how much the sound just after a blow is louder than the quietest part of its ring,
/// dB, for the loudest ring.
double LoudnessDb(const std::vector<Ring>& rings);

}  // namespace carillon::fit
