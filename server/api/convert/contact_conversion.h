// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "absl/status/status.h"
#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/contact_intake.h"

namespace carillon {

/// Returns how the contacts of a stream or of a trace are to be read: in which frame their points
/// are, and which shape their pulses have.
ContactReading ToContactReading(v1::Frame frame, v1::PulseShape pulse_shape);

v1::ContactFindings ToProto(const IntakeFindings& findings);
v1::Blow ToProto(const BlowRecord& blow);

/// Returns the number of contacts and poses in a step.
size_t CountRows(const v1::ContactStep& step);

/// Gives `intake` a whole step, in the order poses, contacts as rows, contacts as columns. Contacts
/// that cannot be read count as rejected (CONTACT_MALFORMED, COLUMNS_MISMATCHED, UNKNOWN_STRIKER).
/// Errors: those of ContactIntake::BeginStep.
absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake);

}  // namespace carillon
