// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "precompute/codec/stored_model.h"

namespace carillon::precompute {

/// Reads the stored form (proto/carillon/v1/modal_model.proto), except the given surface and the
/// references to its triangles.
/// Errors: NotFound FILE_NOT_FOUND, InvalidArgument MODAL_MODEL_MALFORMED, DataLoss
/// MODAL_MODEL_CORRUPT.
absl::StatusOr<StoredModel> ReadModalModel(const std::string& path);

}  // namespace carillon::precompute
