// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// How loud each mode comes out, at its beginning, of a unit impulse along the normal, on average
/// over the surface: c_m <|n . phi_m|> / omega_m = (integral of |n . phi_m| dA)^2 / A, since an
/// impulse g rings as g / omega_m and c_m = omega_m * the integral. Material and size change all
/// modes' by the same factor. Damping and what the ear makes of a frequency are left to them who
/// know the material.
std::vector<double> Audibilities(const ModalModel& model);

/// Leaves out all but the `count` most audible modes (zero: none) and says so in the model.
void KeepMostAudible(int count, ModalModel& model);

}  // namespace carillon::precompute
