// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/sustained_force.h"

#include <algorithm>
#include <cmath>

namespace carillon {
namespace {

/// The smoothing attenuates by 109 dB at the lowest mode, and more at every other one. The free
/// part of a response begins abruptly at its knot. With less attenuation it would click at each
/// knot, and the clicks of a jittering load would add spectral lines between the multiples of the
/// step rate.
constexpr double kSmoothingRadians = 5;
/// A drive that no knot renews for this number of steps is released.
constexpr float kStepsUntilRelease = 4;
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
  if (smoothing.real() > 0) smoothing = -std::norm(s) * tau_s * tau_s / 2;  // as for an impulse
  const std::complex<double> kink = gain * std::exp(smoothing) / (s * s);
  arrays_.kink_re[lane] = static_cast<float>(kink.real());
  arrays_.kink_im[lane] = static_cast<float>(kink.imag());
}

bool SustainedForce::ApplyKnot(const ForceKnot& knot, const LaneArrays& lanes, float* added_re,
                               float* added_im) noexcept {
  const float step_s = std::clamp(knot.step_s, kShortestStepS, kLongestStepS);
  const bool finite = force_kernel::EndStep(1 / step_s, arrays_);
  if (finite) force_kernel::Kink(arrays_, lanes, added_re, added_im);
  const bool travels =
      finite && knot.roughness > 0 && knot.bandwidth_hz >= RoughnessNoise::kLowestHz;
  if (!travels && !driving_) return finite;
  if (travels) noise_.SetBandwidth(knot.bandwidth_hz, sample_rate_hz_);
  force_kernel::SetDrive(driving_ ? position_ : 1, travels ? knot.roughness / sample_rate_hz_ : 0,
                         lanes, arrays_);
  driving_ = true;
  releasing_ = !travels;
  position_ = 0;
  advance_ = 1 / std::max(step_s * sample_rate_hz_, 1.0F);
  frames_until_release_ = static_cast<size_t>(kStepsUntilRelease / advance_);
  return finite;
}

void SustainedForce::Render(size_t frame_count, LaneArrays& lanes,
                            const force_kernel::DrivenOutput& output) noexcept {
  Shares from, to;
  NextShares(frame_count, from, to);
  force_kernel::RingDriven(
      arrays_, {.from_share = from.data(), .to_share = to.data(), .frame_count = frame_count},
      lanes, output);
  if (position_ < 1 || frames_until_release_ > 0) return;
  if (releasing_) {
    driving_ = false;
  } else {
    force_kernel::SetDrive(1, 0, lanes, arrays_);
    position_ = 0;
    releasing_ = true;
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
    } else if (releasing_) {
      frames_until_release_ = 0;
    } else if (frames_until_release_ > 0) {
      --frames_until_release_;
    }
  }
}

}  // namespace carillon
