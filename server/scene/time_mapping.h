// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"

namespace carillon {

/// Maps simulation time to the frames of a mixer, and so decides in which frame a contact sounds.
struct TimeMapping {
  uint64_t first_frame = 0;
  double first_time_s = 0;  ///< simulation time at `first_frame`
  double delay_s = 0;
  /// At `bend_s` after the first time, where the sound is `bend_sound_s` long, the scale of time
  /// changes: simulation time over time of the sound.
  double bend_s = 0;
  double bend_sound_s = 0;
  double scale_before = 1;
  double scale = 1;

  /// Returns the frame in which a contact at this simulation time is due, with its fraction:
  /// frame(t) = first frame + (t - first time + delay) rate
  /// if the scale of time is always 1, and otherwise
  /// frame(t) = first frame + (bend of the sound + (t - first time - bend) / scale + delay) rate
  double FrameOf(double time_s, double sample_rate_hz) const {
    return static_cast<double>(first_frame) + (SoundS(time_s) + delay_s) * sample_rate_hz;
  }

  /// Returns the length of the sound until this simulation time, without the delay, seconds.
  double SoundS(double time_s) const {
    const double since_bend_s = time_s - first_time_s - bend_s;
    return bend_sound_s + since_bend_s / (since_bend_s < 0 ? scale_before : scale);
  }
};

/// Checks the scale of a step's time. Errors: InvalidArgument (INVALID_STREAM).
absl::Status CheckTimeScale(double scale, uint64_t step);

/// Number of frames in a block of an offline rendering. A recorded trace begins at a multiple of
/// this number.
inline constexpr size_t kOfflineBlockFrames = 128;

/// The time for which every step must come late before simulation time is mapped anew. After a
/// shorter pause of the network, the delayed steps come together, and the following steps are in
/// time.
inline constexpr double kLateRunS = 0.25;

/// The shortest sound between two pauses of a simulation that is not too slow.
inline constexpr double kBetweenPausesS = 1;

/// Makes the time mapping of a running simulation from the frames at which its steps come.
class TimeMapper {
 public:
  TimeMapper(double sample_rate_hz, const TimeMapping& mapping)
      : sample_rate_hz_(sample_rate_hz), mapping_(mapping) {}

  const TimeMapping& mapping() const { return mapping_; }
  double FrameOf(double time_s) const { return mapping_.FrameOf(time_s, sample_rate_hz_); }

  /// Maps simulation time `time_s` to `frame`, which is rendered next.
  void Begin(double time_s, uint64_t frame);

  /// Sets the scale of simulation time from `time_s` on, above 0.
  void SetScale(double time_s, double scale);

  /// Lets the sound go on for `sound_s` while simulation time stands. The time from `before_s` to
  /// `time_s` is cut out.
  void Pause(double before_s, double time_s, double sound_s);

  /// Notes that the step of simulation time `time_s` has come when `frame` was the next frame to
  /// render. If every step within kLateRunS has come late, maps simulation time anew, later by
  /// whole blocks, as if this step were the first. A step that alone is late by kLateRunS does so
  /// at once, since it ends a pause; it counts only if pauses follow in quick succession. If the
  /// next steps are in time by the mapping before, that mapping holds again. `resumes` says that
  /// the step follows those of a stated pause, which it ends, and none is counted.
  void Note(double time_s, uint64_t frame, bool resumes);

  /// Number of times that Note has mapped simulation time anew.
  uint64_t remap_count() const { return remap_count_; }

 private:
  /// Maps simulation time later by whole blocks, so that a step that is late by `late_frames` is as
  /// if it were the first.
  void MapLater(double late_frames);
  bool EndsPause(double late_frames, uint64_t frame);
  bool UndoesPause(double time_s, uint64_t frame);

  const double sample_rate_hz_;
  TimeMapping mapping_;
  struct Resumption {
    uint64_t frame = 0;
    uint64_t first_frame_before = 0;  // of the mapping
  };
  std::optional<Resumption> resumed_;    // the newest end of a pause
  std::optional<uint64_t> since_frame_;  // frame at which the present run of late steps began
  uint64_t step_count_ = 0;              // number of steps in the present run
  uint64_t remap_count_ = 0;
};

}  // namespace carillon
