// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// A straight uniform beam.
struct FreeBeam {
  double length_m;
  double area_m2;
  double second_moment_m4;
  double shear_coefficient;  ///< kappa, see the functions below
};

struct BeamMaterial {
  double young_pa;
  double poisson_ratio;
  double density_kg_per_m3;
};

/// Frequency of the lowest bending mode by Timoshenko's theory, Hz: shear and rotary inertia
/// included, from its full frequency equation for modes even about the middle,
///
///     (alpha^2 + q) tan(beta L/2) / beta + (beta^2 - q) tanh(alpha L/2) / alpha = 0,
///
/// with q = rho w^2 / (kappa G), and s = alpha, i beta the roots of
/// s^4 + rho w^2/E (1 + E/(kappa G)) s^2 - rho A w^2/(E I) + rho^2 w^4/(E kappa G) = 0.
double FirstBendingHz(const FreeBeam& beam, const BeamMaterial& material);

/// Frequency of the `order`-th (from 1) bending mode of a beam clamped at one end, free at the
/// other, by Timoshenko's theory, Hz: the root of Huang's frequency equation (J. Appl. Mech. 28,
/// 1961) with b^2 = rho A L^4 w^2 / (E I), r^2 = I / (A L^2), s^2 = E I / (kappa A G L^2); for a
/// slender beam Euler's cosh(beta L) cos(beta L) = -1.
double ClampedBendingHz(const FreeBeam& beam, const BeamMaterial& material, int order);

/// A rectangular bar bending in its plane of `height_m`; kappa by Cowper 1966: 10(1+nu)/(12+11nu).
FreeBeam RectangularBeam(double length_m, double height_m, double width_m, double poisson_ratio);

/// A hollow cylinder; kappa by Cowper 1966, with m the ratio of inner to outer radius:
/// 6(1+nu)(1+m^2)^2 / ((7+6nu)(1+m^2)^2 + (20+12nu)m^2).
FreeBeam TubularBeam(double length_m, double outer_radius_m, double wall_m, double poisson_ratio);

}  // namespace carillon
