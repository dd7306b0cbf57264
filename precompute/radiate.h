// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "carillon/v1/decomposition.pb.h"
#include "precompute/decomposition_observer.h"
#include "precompute/modes/modal_model.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {

/// Processor time, seconds, that the radiation may take where the request sets no limit and the
/// modes took less.
inline constexpr double kLeastRadiationBudgetS = 20;

/// Computes the radiation of the model's modes in the band of the completed `request`, for its
/// material's speed ratio, as request.transfer() says. `modes_cpu_s`: processor time that the modes
/// took. Errors: those of ComputeTransfer.
absl::StatusOr<Transfer> Radiate(const ModalModel& model, const v1::WorkerRequest& request,
                                 double modes_cpu_s, DecompositionObserver& observer);

}  // namespace carillon::precompute
