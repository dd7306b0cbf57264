// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace carillon {

/// Maps simulation time to the frames of a mixer, and so decides in which frame a contact sounds.
struct TimeMapping {
  uint64_t first_frame = 0;
  double first_time_s = 0;  ///< simulation time at `first_frame`
  double delay_s = 0;

  /// Returns the frame in which a contact at this simulation time is due, with its fraction:
  /// frame(t) = first frame + (t - first time + delay) rate
  double FrameOf(double time_s, double sample_rate_hz) const {
    return static_cast<double>(first_frame) + (time_s - first_time_s + delay_s) * sample_rate_hz;
  }
};

/// Number of frames in a block of an offline rendering. A recorded trace begins at a multiple of
/// this number.
inline constexpr size_t kOfflineBlockFrames = 128;

/// The time for which every step must come late before simulation time is mapped anew. After a
/// shorter pause of the network, the delayed steps come together, and the following steps are in
/// time.
inline constexpr double kLateRunS = 0.25;

/// Makes the time mapping of a running simulation from the frames at which its steps come.
class TimeMapper {
 public:
  TimeMapper(double sample_rate_hz, const TimeMapping& mapping)
      : sample_rate_hz_(sample_rate_hz), mapping_(mapping) {}

  const TimeMapping& mapping() const { return mapping_; }
  double FrameOf(double time_s) const { return mapping_.FrameOf(time_s, sample_rate_hz_); }

  /// Maps simulation time `time_s` to `frame`, which is rendered next.
  void Begin(double time_s, uint64_t frame);

  /// Notes that the step of simulation time `time_s` has come when `frame` was the next frame to
  /// render. If every step within kLateRunS has come late, maps simulation time anew, later by
  /// whole blocks, as if this step were the first.
  void Note(double time_s, uint64_t frame);

  /// Number of times that Note has mapped simulation time anew.
  uint64_t remap_count() const { return remap_count_; }

 private:
  const double sample_rate_hz_;
  TimeMapping mapping_;
  std::optional<uint64_t> since_frame_;  // frame at which the present run of late steps began
  uint64_t step_count_ = 0;              // number of steps in the present run
  uint64_t remap_count_ = 0;
};

}  // namespace carillon
