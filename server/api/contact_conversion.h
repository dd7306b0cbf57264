// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/contact_intake.h"

namespace carillon {

/// Gives `intake` a whole step: poses, impulses, forces, then engine contacts; of each, rows before
/// columns. Rows that cannot be read count as rejected (LOCATION_MISSING, COLUMNS_MISMATCHED).
/// Errors: those of ContactIntake::BeginStep.
absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake);

}  // namespace carillon
