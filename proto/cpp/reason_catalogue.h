// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// A row of the tables of proto/errors.md, or a finding of `carillon doctor` in
/// docs/troubleshoot.md.
struct CatalogueReason {
  std::string name;     ///< "MESH_NOT_CLOSED"
  std::string group;    ///< the heading above its table, such as "Meshes"
  std::string code;     ///< the gRPC codes; empty for warnings and findings, which end no call
  std::string meaning;  ///< what is wrong
  std::string repair;   ///< empty for a warning, whose text says it
};

/// Returns all error reasons, warnings and findings, in the order of the tables.
const std::vector<CatalogueReason>& Reasons();

/// Returns the reason that `text` names in small or capital letters, or with which a message such
/// as "MESH_NOT_CLOSED: ..." begins. Errors: InvalidArgument (INVALID_SETTINGS; names the nearest).
absl::StatusOr<CatalogueReason> FindReason(const std::string& text);

}  // namespace carillon
