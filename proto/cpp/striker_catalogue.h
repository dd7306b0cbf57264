// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"

namespace carillon {

/// Returns the named strikers of proto/strikers.textproto.
const v1::StrikerCatalogue& Strikers();

/// Returns the names of all strikers, "steel, wood, ...".
std::string StrikerNames();

/// Returns a striker. Errors: InvalidArgument (UNKNOWN_STRIKER, as UnknownName makes it).
absl::StatusOr<v1::CatalogueStriker> FindStriker(const std::string& name);

}  // namespace carillon
