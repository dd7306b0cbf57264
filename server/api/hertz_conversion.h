// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "server/excitation/hertz.h"

namespace carillon {

/// The figures of the named striker, overridden by those that are present. Errors: InvalidArgument
/// (UNKNOWN_STRIKER).
absl::StatusOr<HertzContact> ToHertzContact(const v1::HertzContact& proto);

}  // namespace carillon
