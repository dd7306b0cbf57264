// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"

namespace carillon {

/// The named strikers of proto/strikers.textproto.
const v1::StrikerCatalogue& Strikers();

/// The names of all strikers, "steel, wood, ...".
std::string StrikerNames();

/// Errors: InvalidArgument (UNKNOWN_STRIKER; the message lists the names, the nearest first).
absl::StatusOr<v1::CatalogueStriker> FindStriker(const std::string& name);

}  // namespace carillon
