// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "precompute/decomposition_observer.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// From a mesh file's bytes to the modal model of the body, with every deformation mode up to the
/// top of the band that the request names. `request` is completed (see worker_request.h). With an
/// accuracy or a budget a surface is filled and solved again, finer each time, until the goal is
/// met or as far as it allows; the model's warnings say where the accuracy asked for was not
/// reached, or a budget was overrun.
///
/// Errors: those of ParseMesh, CheckSurface, Tetrahedralize, Hold and SolveDeformationModes;
/// NO_MODE_IN_BAND with the figure first_mode_hz; INVALID_SETTINGS (linear elements asked of a mesh
/// of ten-node ones); OUTPUT_NOT_WRITABLE. The mesher may also crash the process.
absl::StatusOr<ModalModel> Decompose(std::string mesh_bytes, const v1::WorkerRequest& request,
                                     DecompositionObserver& observer);

}  // namespace carillon::precompute
