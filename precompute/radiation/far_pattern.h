// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "precompute/radiation/acoustic_surface.h"
#include "precompute/radiation/boundary_operator.h"
#include "precompute/radiation/spherical_harmonics.h"

namespace carillon::precompute {

/// Returns the order of harmonics up to which a body within a sphere of this radius radiates at
/// this wavenumber (Gumerov and Duraiswami's rule). Measurements showed that with this order the
/// level in each direction is correct to a decibel.
int PatternOrder(double wavenumber, double radius_m);

/// Returns P at the directions of the grid. Far away, at the distance r from `center`, the pressure
/// is P exp(i k r)/r for dp/dn = n . displacement and the pressure `p` on the surface.
std::vector<std::complex<double>> FarPattern(const AcousticSurface& surface, const Point& center,
                                             double wavenumber, std::span<const ComplexFloat> p,
                                             const Displacement& displacement,
                                             const SphereGrid& grid, Workers& workers);

}  // namespace carillon::precompute
