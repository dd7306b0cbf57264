// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace carillon::wind_chimes {

/// The wind at one place: a gust whose strength and direction wander. The same seed gives the same
/// gust.
class Gust {
 public:
  explicit Gust(uint64_t seed);

  struct Velocity {
    double x_m_per_s;
    double y_m_per_s;
  };

  /// Returns the velocity of the wind at a time in seconds. The wind rises during the first seconds
  /// and falls after `kCalmAfter_s`.
  Velocity At(double time_s) const;

  static constexpr double kCalmAfter_s = 14;

 private:
  static constexpr int kWaves = 6;
  struct Wave {
    double frequency_hz;
    double phase_rad;
  };

  std::array<Wave, kWaves> strength_;
  std::array<Wave, kWaves> direction_;
};

}  // namespace carillon::wind_chimes
