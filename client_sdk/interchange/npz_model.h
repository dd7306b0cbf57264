// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// A modal model as NumPy's .npz: each array of the stored form under its own name, with its own
/// type and shape, and "header", a text: the header as JSON. README.md here has the table.

/// Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteNpz(const std::string& path, const StoredModel& model);

/// Needs "eigenvalues", "vertices", "triangles", "shapes", and "header" or else "poisson_ratio", a
/// number; what else is missing is made of these. Errors: NotFound (FILE_NOT_FOUND),
/// InvalidArgument (MODEL_FILE_MALFORMED, MODEL_FILE_INCOMPLETE), ResourceExhausted
/// (MODEL_FILE_TOO_LARGE, OUT_OF_MEMORY).
absl::StatusOr<StoredModel> ReadNpz(const std::string& path);

}  // namespace carillon::interchange
