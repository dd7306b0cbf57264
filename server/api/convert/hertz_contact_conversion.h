// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "server/excitation/hertz.h"

namespace carillon {

/// Returns the figures of the named striker, overridden by the other figures in `proto`. Errors:
/// InvalidArgument (UNKNOWN_STRIKER).
absl::StatusOr<HertzContact> ToHertzContact(const v1::HertzContact& proto);

}  // namespace carillon
