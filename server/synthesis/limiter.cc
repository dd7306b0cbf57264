// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/limiter.h"

#include <algorithm>
#include <cmath>

namespace carillon {
namespace {

constexpr float kThreshold = 0.70794578F;  // -3 dB of full scale
constexpr double kReleaseS = 0.1;
/// 30 dB above full scale.
constexpr float kMost = 32;

/// f(e) as in the header, for e above the threshold; f(infinity) is one.
float Limited(float envelope) {
  const float over = (envelope - kThreshold) / (1 - kThreshold);
  return kThreshold + (1 - kThreshold) * (1 - 1 / (1 + over));
}

}  // namespace

Limiter::Limiter(double sample_rate_hz, size_t channel_count)
    : channel_count_(channel_count),
      release_(static_cast<float>(std::exp(-1 / (kReleaseS * sample_rate_hz)))) {}

uint64_t Limiter::Apply(std::span<float> block) noexcept {
  uint64_t limited = 0;
  for (; !block.empty(); block = block.subspan(channel_count_)) {
    bool finite = true;
    float peak = 0;
    for (float& sample : block.first(channel_count_)) {
      finite &= std::isfinite(sample);
      if (!std::isfinite(sample)) sample = 0;
      sample = std::clamp(sample, -kMost, kMost);
      peak = std::max(peak, std::abs(sample));
    }
    envelope_ = std::max(peak, release_ * envelope_);
    const bool loud = envelope_ > kThreshold;
    limited += !finite || loud;
    if (!loud) continue;
    const float gain = Limited(envelope_) / envelope_;
    for (float& sample : block.first(channel_count_)) {
      sample = std::clamp(sample * gain, -1.0F, 1.0F);
    }
  }
  return limited;
}

}  // namespace carillon
