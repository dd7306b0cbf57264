// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "precompute/radiation/transfer.h"
#include "precompute/stored_model.h"

namespace carillon::precompute {

/// Writes the stored form (proto/carillon/v1/transfer.proto): to a temporary name beside `path`,
/// then renamed, so that `path` never holds half a transfer. `stored`: the modal model that it
/// belongs to. Errors: Internal OUTPUT_NOT_WRITABLE.
absl::Status WriteTransfer(const std::string& path, const Transfer& transfer,
                           const StoredModel& stored);

}  // namespace carillon::precompute
