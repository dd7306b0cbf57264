// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/base/pose.h"

namespace carillon {

/// The positions of a moving object at the ends of the last blocks. Only the constructor allocates.
class PastPositions {
 public:
  /// `block_count` must be at least two if positions before the end of the last block are needed.
  PastPositions(size_t block_count, const Vector3& position_m)
      : positions_m_(block_count, position_m) {}

  /// Adds the position at the end of the block that has just ended.
  void Add(const Vector3& position_m) noexcept;

  /// Sets all kept positions to `position_m`.
  void Fill(const Vector3& position_m) noexcept;

  const Vector3& newest() const noexcept { return positions_m_[newest_]; }

  /// Returns the position `blocks` blocks before the end of the last block. Between the ends of two
  /// blocks the object moves in a straight line.
  Vector3 Before(double blocks) const noexcept;

  /// Returns the change of position from one block to the block before it, at the time `blocks`
  /// blocks before the end of the last block.
  Vector3 StepBefore(double blocks) const noexcept;

  /// Number of blocks kept.
  size_t size() const noexcept { return positions_m_.size(); }

 private:
  std::vector<Vector3> positions_m_;  // a ring buffer
  size_t newest_ = 0;
};

/// The conversion of distances into delays, and the range of the delays.
struct DelayLimits {
  double frames_per_metre = 0;  ///< sample rate over speed of sound
  size_t block_frame_count = 0;
  double least_frames = 0;
  double most_frames = 0;
};

/// The path of a sound from the place where an object was when it sounded.
struct SoundPath {
  double delay_frames = 0;
  Vector3 away_m{};  ///< from the listener to that place
};

/// Finds the sound that a listener hears at the end of the last block: solves d = |x(t - d) - l| /
/// c for the delay d. `delay_frames` is a first estimate.
SoundPath FindSoundPath(const PastPositions& object, const Vector3& listener_m,
                        const DelayLimits& limits, double delay_frames) noexcept;

/// The delay within one block. A delay line that is read at a changing delay gives the Doppler
/// shift; the slope of the curve is continuous, so that the pitch does not jump at the ends of
/// blocks.
class DelayCurve {
 public:
  /// The delays, in frames, at the ends of four consecutive blocks. The curve lies between the
  /// second and the third: a cubic, whose slopes at its ends follow from the neighbouring delays
  /// (Catmull and Rom).
  explicit DelayCurve(const std::array<double, 4>& delays) noexcept
      : constant_(delays[1]), slope_((delays[2] - delays[0]) / 2) {
    const double last_slope = (delays[3] - delays[1]) / 2;
    cubic_ = 2 * delays[1] + slope_ - 2 * delays[2] + last_slope;
    square_ = -3 * delays[1] - 2 * slope_ + 3 * delays[2] - last_slope;
  }

  /// Returns the delay, in frames, after the fraction `u` (0 to 1) of the block.
  double At(double u) const noexcept {
    return ((cubic_ * u + square_) * u + slope_) * u + constant_;
  }

 private:
  double constant_, slope_, square_, cubic_;
};

}  // namespace carillon
