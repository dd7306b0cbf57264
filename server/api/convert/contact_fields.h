// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/object_contact.h"

namespace carillon {

// The only file that knows the fields of a contact: those of a row, and the columns of many.

/// Returns the kind of contacts, with the default for an unspecified one. Errors: InvalidArgument
/// (CONTACT_MALFORMED: this daemon does not know the kind).
absl::StatusOr<v1::ContactKind> KindOf(v1::ContactKind kind);

/// Fills in a new contact from a row. Errors: InvalidArgument (CONTACT_MALFORMED: the row lacks its
/// point, or the vector that its kind needs; UNKNOWN_STRIKER).
absl::Status ReadRow(const v1::Contact& row, ObjectImpulse& impact);
absl::Status ReadRow(const v1::Contact& row, ObjectForce& force);
absl::Status ReadRow(const v1::Contact& row, ObjectTouch& reported);

/// Checks that columns have numbers for each of their objects. Errors: InvalidArgument
/// (CONTACT_MALFORMED).
absl::Status Validate(const v1::ContactColumns& columns);
absl::Status Validate(const v1::PoseColumns& columns);

/// Returns the number of contacts, counted once for each object. The columns need not be valid.
uint64_t CountContacts(const v1::ContactColumns& columns);

/// Fills in a new contact from one row of columns, which must be valid. The field `hertz` is not
/// read, because it holds for all rows: the caller converts it once and sets it on each contact.
void ReadRow(const v1::ContactColumns& columns, int row, ObjectImpulse& impact);
void ReadRow(const v1::ContactColumns& columns, int row, ObjectForce& force);
void ReadRow(const v1::ContactColumns& columns, int row, ObjectTouch& reported);

/// Reads one row. The columns must be valid.
Pose ReadRow(const v1::PoseColumns& columns, int row);

}  // namespace carillon
