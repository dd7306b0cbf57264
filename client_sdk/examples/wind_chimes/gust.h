// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace carillon::wind_chimes {

/// Wind at one place: gusts of wandering strength and direction that are the same for one seed.
class Gust {
 public:
  explicit Gust(uint64_t seed);

  struct Velocity {
    double x_m_per_s;
    double y_m_per_s;
  };

  /// The wind at a time, seconds. It rises within the first seconds and dies down from
  /// `kCalmAfter_s` on.
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
