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

/// Steel, if nothing else is said.
struct BeamMaterial {
  double young_pa = 210e9;
  double poisson_ratio = 0.3;
  double density_kg_per_m3 = 7850;
};

/// Frequency of the lowest bending mode by Timoshenko's theory, Hz: shear and rotary inertia
/// included, from its full frequency equation for modes even about the middle,
///
///     (alpha^2 + q) tan(beta L/2) / beta + (beta^2 - q) tanh(alpha L/2) / alpha = 0,
///
/// with q = rho w^2 / (kappa G), and s = alpha, i beta the roots of
/// s^4 + rho w^2/E (1 + E/(kappa G)) s^2 - rho A w^2/(E I) + rho^2 w^4/(E kappa G) = 0.
double FirstBendingHz(const FreeBeam& beam, const BeamMaterial& material = {});

/// Frequency of the `order`-th (from 1) bending mode of a beam clamped at one end, free at the
/// other, by Timoshenko's theory, Hz: the root of Huang's frequency equation (J. Appl. Mech. 28,
/// 1961) with b^2 = rho A L^4 w^2 / (E I), r^2 = I / (A L^2), s^2 = E I / (kappa A G L^2); for a
/// slender beam Euler's cosh(beta L) cos(beta L) = -1.
double ClampedBendingHz(const FreeBeam& beam, int order, const BeamMaterial& material = {});

/// A rectangular bar bending in its plane of `height_m`; kappa by Cowper 1966: 10(1+nu)/(12+11nu).
FreeBeam RectangularBeam(double length_m, double height_m, double width_m, double poisson_ratio);

}  // namespace carillon
