// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/decomposition_observer.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {

/// Returns the processor time, seconds, that the radiation of the model may take if the request
/// sets no limit: about the time that the modes take, from 20 to 600. It depends on the model only.
double DefaultRadiationBudget(const ModalModel& model);

/// Computes the radiation of the model's modes in the band of the completed `request`, for the
/// speed ratio of the request's material and with the settings in request.transfer(). Fails with
/// the errors of ComputeTransfer.
absl::StatusOr<Transfer> Radiate(const ModalModel& model, const worker::v1::WorkerRequest& request,
                                 DecompositionObserver& observer);

}  // namespace carillon::precompute
