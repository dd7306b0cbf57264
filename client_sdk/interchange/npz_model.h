// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// A modal model in NumPy's .npz format: each array of the stored form under its own name, with its
/// own type and shape, and a text "header" that is the header as JSON. README.md in this folder has
/// the table.

/// Writes a model. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteNpz(const std::string& path, const StoredModel& model);

/// Reads a model. The file needs "eigenvalues", "vertices", "triangles", "shapes", and either
/// "header" or the number "poisson_ratio"; Complete() adds the other parts. Errors: NotFound
/// (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED),
/// ResourceExhausted (MODAL_MODEL_TOO_LARGE, OUT_OF_MEMORY).
absl::StatusOr<StoredModel> ReadNpz(const std::string& path);

}  // namespace carillon::interchange
