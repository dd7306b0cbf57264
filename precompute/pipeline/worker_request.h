// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/fem/element.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/fix_nodes.h"
#include "precompute/pipeline/intended_use.h"
#include "precompute/pipeline/resolution.h"

namespace carillon::precompute {

/// worker::v1::WorkerRequest is the settings struct of a decomposition. Only the functions in this
/// file complete it, check it, and convert it to the types that the folders of precompute/ take.

/// Returns the request with every default filled in. Errors: INVALID_SETTINGS, INVALID_MATERIAL.
absl::StatusOr<worker::v1::WorkerRequest> Complete(worker::v1::WorkerRequest request);

/// Reads a request in protobuf's text form from a file, and completes it.
/// Errors: INVALID_SETTINGS, INVALID_MATERIAL.
absl::StatusOr<worker::v1::WorkerRequest> ReadWorkerRequest(const std::string& path);

IntendedUse UseOf(const worker::v1::WorkerRequest& request);
MeshingSettings MeshingOf(const worker::v1::WorkerRequest& request);
ResolutionGoal GoalOf(const worker::v1::WorkerRequest& request);
MassSharing MassSharingOf(const worker::v1::WorkerRequest& request);
std::vector<Fixture> FixturesOf(const worker::v1::WorkerRequest& request);

}  // namespace carillon::precompute
