// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "carillon/worker/v1/worker.pb.h"

namespace carillon::precompute {

/// Attaches to the refusal of a decomposition, as data, the changes to `request` that may help.
/// Changes that the request already contains are left out. Errors without a known remedy are
/// returned as they are.
absl::Status WithRemedies(absl::Status refusal, const worker::v1::WorkerRequest& request);

}  // namespace carillon::precompute
