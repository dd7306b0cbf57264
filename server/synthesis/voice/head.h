// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "server/base/pose.h"

namespace carillon {

/// One direction in which a head was measured. The arrays have an element for the left ear, then
/// one for the right ear.
struct MeasuredDirection {
  Vector3 direction{};  ///< in the listener's frame: x right, y up, -z ahead; of any length
  std::array<std::span<const float>, 2> responses{};  ///< head-related impulse responses
  std::array<double, 2> delay_frames{};               ///< by which the responses are to be delayed
};

/// The response of one ear to a sound from one direction, after the delay.
struct EarResponse {
  std::vector<float> taps;
  float delay_frames = 0;
};

/// The responses of the left ear, then of the right ear.
using EarResponses = std::array<EarResponse, 2>;

/// A measured head at one sample rate: the responses of its ears to sounds from all directions.
///
/// Each measured response is split into the delay until its onset and the response from there on.
/// The two parts are interpolated separately, so that the delays of neighbouring directions do not
/// cause comb filtering.
class Head {
 public:
  /// `measured` must not be empty. All responses are scaled by one factor. For a sound from
  /// straight ahead, the mean power of the two ears from 0 to 10 kHz is then 1, which is as loud as
  /// panning is there.
  Head(std::span<const MeasuredDirection> measured, double sample_rate_hz);

  /// Returns responses of zeros that have tap_count() taps.
  EarResponses Silent() const;

  /// Computes the responses for a direction in the listener's frame, of any length but zero. The
  /// responses change continuously with the direction. `responses` must have tap_count() taps.
  /// Neither allocates nor locks.
  void Respond(const Vector3& direction, EarResponses& responses) const noexcept;

  /// Returns the delays of both ears, frames, as Respond does.
  std::array<double, 2> Delays(const Vector3& direction) const noexcept;

  size_t tap_count() const noexcept { return tap_count_; }

  /// The longest delay, frames. The shortest is zero.
  double longest_delay() const noexcept { return longest_delay_; }

 private:
  static constexpr size_t kAzimuths = 72, kElevations = 37;  // one every 5 degrees

  /// The weight of one of the four grid directions around a direction.
  struct Share {
    size_t index = 0;
    double weight = 0;
  };
  static std::array<Share, 4> SharesOf(const Vector3& direction) noexcept;

  size_t tap_count_;
  std::vector<EarResponses> grid_;  // rows of one elevation, from below to above
  double longest_delay_ = 0;
};

}  // namespace carillon
