// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "absl/status/status.h"
#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact.pb.h"
#include "server/excitation/contact.h"
#include "server/scene/contact_intake.h"

namespace carillon {

/// Returns how the contacts of a stream or of a trace are to be read: in which frame their points
/// are, and which shape their pulses have.
ContactReading ToContactReading(v1::Frame frame, v1::PulseShape pulse_shape);

v1::ContactFindings ToProto(const IntakeFindings& findings);
v1::Blow ToProto(const BlowRecord& blow);

/// Gives `intake` these rows of columns, which must be valid and of a known kind. `hertz` has the
/// known figures of the collisions.
void ReadRows(const v1::ContactColumns& columns, std::span<const int> rows,
              const HertzContact& hertz, ContactIntake& intake);

/// Gives `intake` a whole step, in the order poses, contacts as rows, contacts as columns. Contacts
/// that cannot be read count as rejected (CONTACT_MALFORMED, UNKNOWN_STRIKER).
/// Errors: those of ContactIntake::BeginStep.
absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake);

}  // namespace carillon
