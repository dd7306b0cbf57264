// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// Returns the initial loudness of each mode after a unit impulse along the normal, averaged over
/// the surface. It is c_m <|n . phi_m|> / omega_m = (integral of |n . phi_m| dA)^2 / A, because a
/// modal impulse g gives the amplitude g / omega_m, and c_m is omega_m times the integral. Material
/// and size multiply the loudness of all modes by the same factor. Damping and the sensitivity of
/// the ear are not considered, because they depend on the material.
std::vector<double> Audibilities(const ModalModel& model);

/// Keeps only the modes whose indices are in `kept`, which is ascending.
void KeepModes(const std::vector<size_t>& kept, ModalModel& model);

/// Keeps only the `count` most audible modes and adds a warning to the model. If `count` is zero,
/// keeps all modes.
void KeepMostAudible(int count, ModalModel& model);

}  // namespace carillon::precompute
