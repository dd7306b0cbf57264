// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sustained_force.h"

#include <algorithm>
#include <cmath>

namespace carillon {
namespace {

/// At the lowest mode the smoothing takes 39 dB, an octave above 156 dB.
constexpr double kSmoothingRadians = 3;
/// A force that no knot renews for so many steps is let go.
constexpr float kStepsToHold = 4;
constexpr float kShortestStepS = 1e-5F;
constexpr float kLongestStepS = 1;

}  // namespace

SustainedForce::SustainedForce(size_t lane_count, size_t column_count, double sample_rate_hz,
                               uint64_t seed)
    : arrays_(lane_count, column_count),
      sample_rate_hz_(static_cast<float>(sample_rate_hz)),
      noise_(seed) {}

void SustainedForce::SetLane(size_t lane, std::complex<double> gain, std::complex<double> s,
                             double lowest_rad_per_s) {
  const double tau_s = kSmoothingRadians / lowest_rad_per_s;
  std::complex<double> smoothing = s * s * tau_s * tau_s / 2.0;
  if (smoothing.real() > 0) smoothing = -std::norm(s) * tau_s * tau_s / 2;  // as for a strike
  const std::complex<double> kink = gain * std::exp(smoothing) / (s * s);
  arrays_.kink_re[lane] = static_cast<float>(kink.real());
  arrays_.kink_im[lane] = static_cast<float>(kink.imag());
}

bool SustainedForce::Tie(const ForceKnot& knot, const LaneArrays& lanes, float* added_re,
                         float* added_im) noexcept {
  const float step_s = std::clamp(knot.step_s, kShortestStepS, kLongestStepS);
  const bool finite = force_kernel::EndStep(1 / step_s, arrays_);
  if (finite) force_kernel::Kink(arrays_, lanes, added_re, added_im);
  const bool travels =
      finite && knot.roughness > 0 && knot.bandwidth_hz >= RoughnessNoise::kLowestHz;
  if (!travels && !driving_) return finite;
  if (travels) noise_.SetBandwidth(knot.bandwidth_hz, sample_rate_hz_);
  force_kernel::Aim(driving_ ? position_ : 1, travels ? knot.roughness / sample_rate_hz_ : 0, lanes,
                    arrays_);
  driving_ = true;
  letting_go_ = !travels;
  position_ = 0;
  advance_ = 1 / std::max(step_s * sample_rate_hz_, 1.0F);
  frames_to_hold_ = static_cast<size_t>(kStepsToHold / advance_);
  return finite;
}

void SustainedForce::Render(size_t frame_count, LaneArrays& lanes, float* mix) noexcept {
  Shares from, to;
  NextShares(frame_count, from, to);
  force_kernel::RingDriven(
      arrays_, {.from_share = from.data(), .to_share = to.data(), .frame_count = frame_count},
      lanes, mix);
  if (position_ < 1 || frames_to_hold_ > 0) return;
  if (letting_go_) {
    driving_ = false;
  } else {
    force_kernel::Aim(1, 0, lanes, arrays_);
    position_ = 0;
    letting_go_ = true;
  }
}

void SustainedForce::Silence() noexcept {
  driving_ = false;
  arrays_.Clear();
}

void SustainedForce::NextShares(size_t frame_count, Shares& from, Shares& to) noexcept {
  for (size_t n = 0; n < frame_count; ++n) {
    const float noise = noise_.Next();
    from[n] = (1 - position_) * noise;
    to[n] = position_ * noise;
    if (position_ < 1) {
      position_ = std::min(position_ + advance_, 1.0F);
    } else if (letting_go_) {
      frames_to_hold_ = 0;
    } else if (frames_to_hold_ > 0) {
      --frames_to_hold_;
    }
  }
}

}  // namespace carillon
