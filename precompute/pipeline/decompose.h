// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// Computes the modal model of a body from the bytes of a mesh file. The model has every
/// deformation mode up to the top of the band that the request names. `request` has all defaults
/// filled in (see worker_request.h). If the request has an accuracy or a budget, the surface is
/// filled and solved again with finer meshes until the accuracy is reached or the budget is spent.
/// The model's warnings say if the accuracy was not reached or the budget was exceeded.
///
/// Errors: those of ParseMesh, CheckSurface, Tetrahedralize, FixNodes and SolveDeformationModes;
/// NO_MODE_IN_BAND with the figure first_mode_hz; INVALID_SETTINGS if linear elements are requested
/// but the mesh has ten-node elements; OUTPUT_NOT_WRITABLE. The mesh generator may also crash the
/// process.
absl::StatusOr<ModalModel> Decompose(std::string mesh_bytes,
                                     const worker::v1::WorkerRequest& request,
                                     DecompositionObserver& observer);

}  // namespace carillon::precompute
