// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// Adds to the refusal of a decomposition the changes to `request` that may help, as data. A change
/// that the request has already is left out. Other errors get none.
absl::Status WithRemedies(absl::Status refusal, const v1::WorkerRequest& request);

}  // namespace carillon::precompute
