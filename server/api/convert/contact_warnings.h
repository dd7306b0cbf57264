// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact_service.pb.h"
#include "server/scene/contact_intake.h"

namespace carillon {

/// Fills in the warnings of a stream's answer from its other fields and from the findings about its
/// contacts. Each warning is a probable mistake of the client; proto/errors.md lists them.
void AddWarnings(const IntakeFindings& findings, v1::StreamContactsResponse& report);

/// Does the same for a rendering, in which no contact is late.
void AddWarnings(const IntakeFindings& findings, v1::RenderSummary& summary);

/// Adds the warnings about impulses and points. `accepted_count` impulses sounded.
void AddContactWarnings(const IntakeFindings& findings, uint64_t accepted_count,
                        google::protobuf::RepeatedPtrField<v1::Warning>& warnings);

}  // namespace carillon
