// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "precompute/fem/body_materials.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// Returns whether the estimated errors of the mesh's modes may be far too small: if it has few
/// quadratic elements, or if most of its elements are more than 20 times as long as they are high.
/// Where an element spans much of a wavelength, the result of EstimateFrequencyErrors() is too
/// small, in the worst case by a factor of hundreds, and modes are missing. Meshes whose fineness
/// Carillon chooses have at least twice as many nodes, and on plates, bowls and tubes their
/// elements are at most 12 times as long as they are high.
bool HasFewElements(const TetMesh& mesh);

/// Returns `mesh` with its elements divided until HasFewElements is false. HasFewElements must be
/// true for `mesh`.
TetMesh Refined(const TetMesh& mesh);

/// Computes the modes of `finer`, a finer mesh of the same body, and compares them with the modes
/// of `model`, whose mesh has few elements. The modes are compared in ascending order. If the
/// difference of a mode is larger than the mode's estimated error, it becomes the estimated error.
/// If modes are missing, or an estimated error was too small, the model gets a warning that says
/// so. `elastic` and `sharing` are those of the model's matrices. All modes of the model's mesh
/// below its limit must be in the model.
void CompareWith(const TetMesh& finer, const BodyMaterials& materials, MassSharing sharing,
                 ModalModel& model);

}  // namespace carillon::precompute
