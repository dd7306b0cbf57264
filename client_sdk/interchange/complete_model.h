// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Adds the parts of a model that a file of another format may leave out, and checks the model. The
/// sounding surface replaces a missing surface as given. Each missing residual becomes the largest
/// residual that the header states. The model counts as complete up to its last eigenvalue unless
/// it states another. Couplings and volume are computed. Estimated errors are dropped unless there
/// is one for each mode. Errors: those of Validate().
absl::Status Complete(StoredModel& model);

}  // namespace carillon::interchange
