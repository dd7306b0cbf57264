// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// The initial loudness of each mode after a unit impulse along the normal, averaged over the
/// surface: c_m <|n . phi_m|> / omega_m = (integral of |n . phi_m| dA)^2 / A, since an impulse g
/// rings as g / omega_m and c_m = omega_m * the integral. Material and size multiply the loudness
/// of all modes by the same factor. Damping and the sensitivity of the ear are not considered,
/// because they depend on the material.
std::vector<double> Audibilities(const ModalModel& model);

/// Keeps these modes of a model, given by their indices in ascending order.
void KeepModes(const std::vector<size_t>& kept, ModalModel& model);

/// Keeps only the `count` most audible modes and adds a warning to the model. Zero: keeps all
/// modes.
void KeepMostAudible(int count, ModalModel& model);

}  // namespace carillon::precompute
