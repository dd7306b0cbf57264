// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace carillon {

/// Noise of unit variance and settable bandwidth. Uniform white noise passes two equal one-pole
/// low-passes, y(n) = (1 - p) x(n) + p y(n - 1), and a high-pass at 20 Hz that makes its mean zero.
/// The same seed gives the same noise.
class RoughnessNoise {
 public:
  explicit RoughnessNoise(uint64_t seed) noexcept : state_(Mix(seed)) {}

  /// The least bandwidth; narrower noise would be inaudible.
  static constexpr double kLowestHz = 20;

  /// Sets the frequency at which the spectrum has fallen by 6 dB: kLowestHz to about half of
  /// Nyquist. The noise continues without a jump.
  void SetBandwidth(double bandwidth_hz, double sample_rate_hz) noexcept {
    const double pole = std::exp(-2 * std::numbers::pi * bandwidth_hz / sample_rate_hz);
    // Variance of white noise of variance 1/3 after both low-passes: (1-p)^4 (1+p^2)/(1-p^2)^3 / 3.
    const double variance = (1 - pole) * (1 + pole * pole) / std::pow(1 + pole, 3) / 3;
    const auto gain = static_cast<float>(1 / std::sqrt(variance));
    for (float* state : {&first_, &second_, &mean_}) *state *= gain_ > 0 ? gain_ / gain : 1;
    gain_ = gain;
    pole_ = static_cast<float>(pole);
    block_ = static_cast<float>(2 * std::numbers::pi * kLowestHz / sample_rate_hz);
  }

  float Next() noexcept {
    state_ += kIncrement;
    const float white = static_cast<float>(static_cast<int32_t>(Mix(state_) >> 32)) * 0x1p-31F;
    first_ += (1 - pole_) * (white - first_);
    second_ += (1 - pole_) * (first_ - second_);
    mean_ += block_ * (second_ - mean_);
    return gain_ * (second_ - mean_);
  }

 private:
  static constexpr uint64_t kIncrement = 0x9E3779B97F4A7C15;

  /// SplitMix64: hashes a counter with David Stafford's variant 13 of MurmurHash3's finalizer.
  static uint64_t Mix(uint64_t x) noexcept {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB;
    return x ^ (x >> 31);
  }

  uint64_t state_;
  float pole_ = 0, gain_ = 0, block_ = 0;
  float first_ = 0, second_ = 0, mean_ = 0;
};

}  // namespace carillon
