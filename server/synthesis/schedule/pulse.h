// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace carillon {

/// The spread of an impulse over the time of its contact. It has four bytes, because events have no
/// room for more. The middle of the pulse lies at the time of the impulse.
class Pulse {
 public:
  /// The impulse acts in an instant.
  constexpr Pulse() = default;

  /// w(t) = (1 + cos(2 pi t/T))/T from -T/2 to T/2, T = `duration_s`.
  static constexpr Pulse RaisedCosine(float duration_s) { return Pulse(duration_s); }

  /// A Gaussian whose standard deviation is T/4 (the paper, 3.5).
  static constexpr Pulse Gaussian(float duration_s) { return Pulse(-duration_s); }

  bool gaussian() const noexcept { return signed_duration_s_ < 0; }
  float duration_s() const noexcept { return std::abs(signed_duration_s_); }

  /// Returns a pulse of the same shape that lasts `duration_s`.
  Pulse Lasting(float duration_s) const noexcept {
    return gaussian() ? Gaussian(duration_s) : RaisedCosine(duration_s);
  }

  /// The variance of the pulse as a distribution over time, s^2: T^2 (1/12 - 1/(2 pi^2)) for a
  /// raised cosine, T^2/16 for a Gaussian.
  float variance_s2() const noexcept {
    return (gaussian() ? kGaussianVariance : kCosineVariance) * signed_duration_s_ *
           signed_duration_s_;
  }

  /// Returns the pulse with this variance and the shape of `like`.
  static Pulse OfVariance(float variance_s2, Pulse like) noexcept {
    return like.gaussian() ? Gaussian(std::sqrt(variance_s2 / kGaussianVariance))
                           : RaisedCosine(std::sqrt(variance_s2 / kCosineVariance));
  }

  friend bool operator==(Pulse, Pulse) = default;

 private:
  static constexpr float kCosineVariance = 0.0326726F;
  static constexpr float kGaussianVariance = 1.0F / 16;

  explicit constexpr Pulse(float signed_duration_s) : signed_duration_s_(signed_duration_s) {}

  float signed_duration_s_ = 0;  // below zero: a Gaussian
};

}  // namespace carillon
