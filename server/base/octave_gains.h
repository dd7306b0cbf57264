// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace carillon {

/// A gain for each of eight octaves, in steps of a quarter of a decibel from -31.75 to 31.75 dB.
/// The octaves are those around 125, 250, ... 16,000 Hz; the first and the last have no outer end.
/// It has eight bytes, because events contain it.
class OctaveGains {
 public:
  static constexpr size_t kCount = 8;

  /// Returns the octave to which a frequency belongs.
  static size_t OctaveOf(double frequency_hz) {
    const double octaves = std::floor(std::log2(frequency_hz / 125) + 0.5);
    return static_cast<size_t>(std::clamp(octaves, 0.0, double{kCount - 1}));
  }

  /// Sets a gain, rounded down, so that energies whose sum is bounded stay within the bound.
  void SetDb(size_t octave, double gain_db) {
    quarter_db_[octave] = static_cast<int8_t>(std::floor(std::clamp(gain_db, -31.75, 31.75) * 4));
  }

  /// The gain of an octave as a factor of amplitudes.
  float Factor(size_t octave) const {
    return std::exp2(static_cast<float>(quarter_db_[octave]) * kOctavesPerStep);
  }

  /// Whether every gain is 0 dB.
  bool none() const { return quarter_db_ == decltype(quarter_db_){}; }

  friend bool operator==(const OctaveGains&, const OctaveGains&) = default;

 private:
  static constexpr float kOctavesPerStep = 0.0415241F;  // log2(10)/80

  std::array<int8_t, kCount> quarter_db_{};
};

}  // namespace carillon
