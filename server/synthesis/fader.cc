// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/fader.h"

namespace carillon {
namespace {

constexpr double kGlideS = 0.03;

}  // namespace

Fader::Fader(double sample_rate_hz, float gain)
    : frame_count_(static_cast<uint32_t>(kGlideS * sample_rate_hz)),
      frame_(frame_count_),
      from_(gain),
      to_(gain) {}

void Fader::GlideTo(float gain) noexcept {
  if (gain == to_) return;
  from_ = Now();
  to_ = gain;
  frame_ = 0;
}

void Fader::JumpTo(float gain) noexcept {
  from_ = to_ = gain;
  frame_ = frame_count_;
}

float Fader::Now() const noexcept {
  if (resting()) return to_;
  const float t = static_cast<float>(frame_) / static_cast<float>(frame_count_);
  return from_ + (to_ - from_) * t * t * (3 - 2 * t);
}

void Fader::Multiply(std::span<float> gains) noexcept {
  if (neutral()) return;
  for (float& gain : gains) {
    gain *= Now();
    if (!resting()) ++frame_;
  }
}

}  // namespace carillon
