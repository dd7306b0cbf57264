// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Adds the parts of a model that a file of another format may leave out, and checks the model. The
/// sounding surface is taken for the surface as given, the largest residual that the header states
/// for each residual, and the last eigenvalue for the eigenvalue up to which the model is complete.
/// Couplings and volume are computed. Estimated errors are dropped unless there is one for each
/// mode. Errors: those of Validate().
absl::Status Complete(StoredModel& model);

}  // namespace carillon::interchange
