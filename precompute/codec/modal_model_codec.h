// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// The mesh file and the settings from which a model was made. The header of the model's file
/// contains them.
struct ModelOrigin {
  std::string mesh_digest;             ///< SHA-256 of the mesh file
  v1::DecompositionSettings settings;  ///< with every default filled in
};

/// Writes the stored form (see proto/carillon/v1/modal_model.proto) under a temporary name next to
/// `path` and renames it, so that `path` never contains half a model.
///
/// Errors: Internal OUTPUT_NOT_WRITABLE.
absl::Status WriteModalModel(const std::string& path, const ModalModel& model,
                             const ModelOrigin& origin);

}  // namespace carillon::precompute
