// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon::wind_chimes {

/// Returns the duration of the impact of two elastic bodies in seconds,
///
///   T = 2.87 (m^2/(R E^2 v))^(1/5)
///
/// (Johnson, Contact Mechanics, section 11.4), with the reduced mass m in kg, the reduced radius of
/// curvature R in m, the contact modulus E in Pa and the speed of approach v in m/s.
double HertzDuration(double mass_kg, double radius_m, double modulus_pa, double speed_m_per_s);

}  // namespace carillon::wind_chimes
