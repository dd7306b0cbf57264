// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/wind_chimes/hertz.h"

#include <cmath>

namespace carillon::wind_chimes {

double HertzDuration(double mass_kg, double radius_m, double modulus_pa, double speed_m_per_s) {
  return 2.87 *
         std::pow(mass_kg * mass_kg / (radius_m * modulus_pa * modulus_pa * speed_m_per_s), 0.2);
}

}  // namespace carillon::wind_chimes
