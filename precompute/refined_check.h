// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/fem/elastic_constants.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// Returns whether the estimated errors of the mesh's modes may be far too small: if it has few
/// quadratic elements, or if most of them are more than 20 times as long as high. Where an element
/// spans much of a wavelength, EstimateFrequencyErrors() is too small, by a factor of hundreds in
/// the worst case, and modes are missing. Meshes whose fineness Carillon chooses have at least
/// twice as many nodes, and elements at most 12 times as long as high on plates, bowls and tubes.
bool HasFewElements(const TetMesh& mesh);

/// Returns the mesh, which HasFewElements(), with its elements divided until it has more.
TetMesh Refined(const TetMesh& mesh);

/// Compares a model whose mesh has few elements with the modes of a finer mesh of the same body,
/// `finer`. The modes are compared in ascending order. The errors of the model become those of
/// the comparison where these are larger, and a warning states the number of missing modes.
/// `elastic` and `sharing` are those of the model's matrices. All modes of the model's mesh below
/// its limit must be in the model.
void CompareWith(const TetMesh& finer, const ElasticConstants& elastic, MassSharing sharing,
                 ModalModel& model);

}  // namespace carillon::precompute
