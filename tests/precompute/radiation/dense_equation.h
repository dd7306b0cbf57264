// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Dense>

#include "precompute/radiation/acoustic_surface.h"
#include "precompute/radiation/near_correction.h"

namespace carillon::precompute {

/// The left side of BoundaryOperator's equation as a matrix of complex numbers, assembled in double
/// without any of its kernels. `radius_m`: of a sphere around the surface.
Eigen::MatrixXcd AssembleDense(const AcousticSurface& surface, const NearCorrection& near,
                               double wavenumber, double radius_m);

}  // namespace carillon::precompute
