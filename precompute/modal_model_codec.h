// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// What the header says beside the model itself.
struct ModelOrigin {
  std::string mesh_digest;             ///< SHA-256 of the mesh file
  v1::DecompositionSettings settings;  ///< every default filled in
};

/// Writes the stored form (proto/carillon/v1/modal_model.proto): to a temporary name beside `path`,
/// then renamed, so that `path` never holds half a model.
/// Errors: Internal OUTPUT_NOT_WRITABLE.
absl::Status WriteModalModel(const std::string& path, const ModalModel& model,
                             const ModelOrigin& origin);

}  // namespace carillon::precompute
