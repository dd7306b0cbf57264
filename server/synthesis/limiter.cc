// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/limiter.h"

#include <algorithm>
#include <cmath>

namespace carillon {
namespace {

constexpr float kThreshold = 0.70794578F;  // -3 dB of full scale
constexpr double kReleaseS = 0.1;

/// f(e) of the header, for e above the threshold; e = infinity gives one.
float Limited(float envelope) {
  const float over = (envelope - kThreshold) / (1 - kThreshold);
  return kThreshold + (1 - kThreshold) * (1 - 1 / (1 + over));
}

}  // namespace

Limiter::Limiter(double sample_rate_hz)
    : release_(static_cast<float>(std::exp(-1 / (kReleaseS * sample_rate_hz)))) {}

uint64_t Limiter::Apply(std::span<float> block) noexcept {
  uint64_t limited = 0;
  for (float& sample : block) {
    const bool finite = std::isfinite(sample);
    if (!finite) sample = 0;
    envelope_ = std::max(std::abs(sample), release_ * envelope_);
    const bool loud = envelope_ > kThreshold;
    if (loud) sample = std::clamp(sample * (Limited(envelope_) / envelope_), -1.0F, 1.0F);
    limited += !finite || loud;
  }
  return limited;
}

}  // namespace carillon
