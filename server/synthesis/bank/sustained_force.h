// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>

#include "server/synthesis/bank/roughness_noise.h"
#include "server/synthesis/ringing/force_kernel.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/lane_mix.h"
#include "server/synthesis/ringing/strike_kernel.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// A force on one bank that lasts: a load, a slide, a roll (physics.md 3). Between the knots, which
/// are the simulation's steps, the modal forces run straight (a linear B-spline, which sums to one
/// whatever the step times), smoothed by a Gaussian of standard deviation 3 / omega of the lowest
/// mode, so that nothing of the steps themselves is heard. Of the response only what rings free is
/// rendered: each change of slope d adds
///
///   gain d exp(s^2 tau^2/2) / s^2
///
/// to the state, the free part of the response to a ramp. The rest follows the force below the
/// lowest mode and is no sound; so a constant force is exactly silent. Where the contact travels
/// over a rough surface, noise multiplied onto the force drives the modes sample by sample.
///
/// Made anywhere; then used by one thread at a time. Nothing but making it allocates or locks.
class SustainedForce {
 public:
  /// `seed` makes the noise of this object its own.
  SustainedForce(size_t lane_count, size_t column_count, double sample_rate_hz, uint64_t seed);

  /// Sets what lane `lane` gains from a change of slope: `gain` and `s` are its own (1/s),
  /// `lowest_rad_per_s` is the lowest mode's.
  void SetLane(size_t lane, std::complex<double> gain, std::complex<double> s,
               double lowest_rad_per_s);

  /// Adds a contact's force to that at the next knot.
  void Gather(const strike_kernel::Projection& projection) noexcept {
    force_kernel::Gather(projection, arrays_.next.data());
  }

  /// The next knot is now: what that adds to the states, into added_re and added_im. False: the
  /// force was not finite, and is zero, and nothing is to be added.
  bool Tie(const ForceKnot& knot, const LaneArrays& lanes, float* added_re,
           float* added_im) noexcept;

  /// The noise is heard: Render is to be called for every sample.
  bool driving() const noexcept { return driving_; }

  /// The next samples of all lanes, driven, into `mix`, as ring_kernel::RingStruck does.
  void Render(size_t frame_count, LaneArrays& lanes, float* mix) noexcept;

  /// There is no force from now on.
  void Silence() noexcept;

 private:
  using Shares = std::array<float, kMostBlockFrames>;

  void NextShares(size_t frame_count, Shares& from, Shares& to) noexcept;

  ForceArrays arrays_;
  float sample_rate_hz_;
  RoughnessNoise noise_;
  bool driving_ = false;
  bool letting_go_ = false;    // no knot came: the drive goes to zero
  float position_ = 1;         // on the way from the last knot to the next, 0 to 1
  float advance_ = 0;          // of the position, each frame
  size_t frames_to_hold_ = 0;  // beyond position 1, while the next knot may be late
};

}  // namespace carillon
