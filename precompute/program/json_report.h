// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/intended_use.h"
#include "precompute/program/progress_reporter.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {

/// Returns the object that --json prints: nodes, elements, unknowns, peak_memory_bytes, phases, the
/// count of modes left out, warnings, the modes of the model that lie in the band of `use`, and
/// with --check-with the comparison of the solvers ("check"). If `transfer` is not null, the object
/// also describes how each mode radiates ("radiation").
std::string JsonReport(const ModalModel& model, const Transfer* transfer, const IntendedUse& use,
                       const ProgressReporter& reporter);

/// Returns the object that --json prints when a request is refused: "error", with reason, message
/// and figures.
std::string JsonError(const absl::Status& status);

}  // namespace carillon::precompute
