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

/// A sustained force on one bank: a load, a slide or a roll
/// (docs/physics.md, 3). Between knots, which are the
/// simulation's steps, the modal forces are interpolated linearly and smoothed by a Gaussian of
/// standard deviation 5 / omega of the lowest mode, so that the steps themselves are inaudible.
/// Only the free part of the response is rendered: each change of slope d adds
///
///   gain d exp(s^2 tau^2/2) / s^2
///
/// to the state, which is the free part of the response to a ramp. The rest of the response follows
/// the force at frequencies below the lowest mode and is inaudible, so a constant force is exactly
/// silent. If the contact travels over a rough surface, noise multiplied by the force drives the
/// modes sample by sample.
///
/// Any thread may construct the object; then one thread at a time uses it. Only the constructor
/// allocates.
class SustainedForce {
 public:
  /// Different seeds give different noise.
  SustainedForce(size_t lane_count, size_t column_count, double sample_rate_hz, uint64_t seed);

  /// Sets the response of lane `lane` to a change of slope: `gain` and `s` (1/s) are of this lane,
  /// `lowest_rad_per_s` is the lowest mode's frequency.
  void SetLane(size_t lane, std::complex<double> gain, std::complex<double> s,
               double lowest_rad_per_s);

  /// Adds a contact's force to the whole force of the next knot.
  void AddForce(const strike_kernel::Projection& projection) noexcept {
    force_kernel::AddForce(projection, arrays_.next.data());
  }

  /// The whole force of the next knot so far, by columns of modal impulses.
  float* next() noexcept { return arrays_.next.data(); }

  /// Ends a step, and writes the knot's contribution to the states into added_re and added_im.
  /// Returns false if the force was not finite; it is then zero, and nothing is written.
  bool ApplyKnot(const ForceKnot& knot, const LaneArrays& lanes, float* added_re,
                 float* added_im) noexcept;

  /// Whether noise drives the modes, so that Render must be called for every sample.
  bool driving() const noexcept { return driving_; }

  /// Adds the next samples of all lanes to the output while driving them.
  void Render(size_t frame_count, LaneArrays& lanes,
              const force_kernel::DrivenOutput& output) noexcept;

  /// Sets the force to zero.
  void Silence() noexcept;

 private:
  using Shares = std::array<float, kMostBlockFrames>;

  void NextShares(size_t frame_count, Shares& from, Shares& to) noexcept;

  bool driving_ = false;  // first, because it is read in every block
  ForceArrays arrays_;
  float sample_rate_hz_;
  RoughnessNoise noise_;
  bool releasing_ = false;           // the drive goes to zero
  float position_ = 1;               // from the last knot (0) to the next (1)
  float advance_ = 0;                // of the position per frame
  size_t frames_until_release_ = 0;  // at position 1, if no knot comes
};

}  // namespace carillon
