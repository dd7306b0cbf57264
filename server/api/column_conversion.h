// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/contact.pb.h"
#include "server/api/contact_conversion.h"

namespace carillon {

/// Give `sink` what columns hold, or reject it whole (COLUMNS_MISMATCHED).
void ReadColumns(const v1::ImpulseColumns& columns, const ContactSink& sink);
void ReadColumns(const v1::PoseColumns& columns, const ContactSink& sink);

}  // namespace carillon
