// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/contact_stream.h"

namespace carillon {

/// Gives `use` every impulse of a step, rows first, and `reject` how many could not be read and why
/// (LOCATION_MISSING, COLUMNS_MISMATCHED).
void ForEachImpulse(const v1::ContactStep& step, absl::FunctionRef<void(const ObjectImpulse&)> use,
                    absl::FunctionRef<void(uint64_t, absl::Status)> reject);

}  // namespace carillon
