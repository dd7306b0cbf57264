// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/object_contact.h"

namespace carillon {

/// Checks that columns have numbers for each of their objects. Errors: InvalidArgument
/// (COLUMNS_MISMATCHED).
absl::Status Validate(const v1::ImpulseColumns& columns);
absl::Status Validate(const v1::EngineContactColumns& columns);
absl::Status Validate(const v1::PoseColumns& columns);

/// Returns the number of contacts, counted once for each object. The columns need not be valid.
uint64_t CountContacts(const v1::ImpulseColumns& columns);

/// Fills in a new contact from one row. The columns must be valid. The field `hertz` of impulses is
/// not read, because it holds for all rows: the caller converts it once and sets it on each
/// contact.
void ReadRow(const v1::ImpulseColumns& columns, int row, ObjectImpulse& impulse);
void ReadRow(const v1::EngineContactColumns& columns, int row, ObjectTouch& touch);

/// Reads one row. The columns must be valid.
Pose ReadRow(const v1::PoseColumns& columns, int row);

}  // namespace carillon
