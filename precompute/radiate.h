// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "precompute/decomposition_observer.h"
#include "precompute/modes/modal_model.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {

/// Processor time, seconds, that the radiation may take if the request sets no limit and the modes
/// took less than this.
inline constexpr double kLeastRadiationBudgetS = 20;

/// Computes the radiation of the model's modes in the band of the completed `request`, for the
/// speed ratio of the request's material and with the settings in request.transfer(). `modes_cpu_s`
/// is the processor time that the modes took. Errors: those of ComputeTransfer.
absl::StatusOr<Transfer> Radiate(const ModalModel& model, const v1::WorkerRequest& request,
                                 double modes_cpu_s, DecompositionObserver& observer);

}  // namespace carillon::precompute
