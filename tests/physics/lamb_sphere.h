// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Lowest modes of a free elastic sphere (Lamb 1882) as eta = omega R / c_t, with c_t the speed of
/// shear waves.

/// The torsional mode of degree l = 2: root of (l - 1) j_l(eta) = eta j_{l+1}(eta).
double LowestTorsionalEta();

/// The spheroidal mode of degree l = 2 (the sphere becomes long and flat by turns).
double LowestSpheroidalEta(double poisson_ratio);

}  // namespace carillon
