// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/final_fade.h"

#include <cmath>
#include <numbers>

namespace carillon {
namespace {

constexpr double kLength_s = 0.05;

}  // namespace

FinalFade::FinalFade(const DeviceFormat& format)
    : channel_count_(format.channel_count), frame_count_(kLength_s * format.sample_rate_hz) {}

void FinalFade::Apply(std::span<float> block) noexcept {
  if (!begun_.load(std::memory_order_relaxed)) return;
  const bool silent = frame_ >= frame_count_;
  for (size_t i = 0; i < block.size(); ++i) {
    if (i > 0 && i % channel_count_ == 0) frame_ += 1;
    block[i] *= static_cast<float>(Gain());
  }
  frame_ += 1;
  if (silent) ended_.store(true, std::memory_order_relaxed);
}

double FinalFade::Gain() const noexcept {
  if (frame_ >= frame_count_) return 0;
  return 0.5 + 0.5 * std::cos(std::numbers::pi * frame_ / frame_count_);
}

}  // namespace carillon
