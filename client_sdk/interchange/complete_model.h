// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Makes what a file of another format may leave out, and checks the whole: the surface as given
/// (the sounding surface), the residuals (the largest that the header states), the couplings, the
/// volume, and the eigenvalue up to which it is complete (the last). Estimated errors that are not
/// one a mode are dropped. Errors: as Validate.
absl::Status Complete(StoredModel& model);

}  // namespace carillon::interchange
