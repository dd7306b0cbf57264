// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "precompute/codec/stored_model.h"
#include "precompute/radiation/transfer.h"

namespace carillon::precompute {

/// Writes the stored form (proto/carillon/v1/transfer.proto) under a temporary name next to `path`
/// and renames it, so that `path` never contains half a transfer. `stored` is the modal model to
/// which the transfer belongs. Errors: Internal OUTPUT_NOT_WRITABLE.
absl::Status WriteTransfer(const std::string& path, const Transfer& transfer,
                           const StoredModel& stored);

}  // namespace carillon::precompute
