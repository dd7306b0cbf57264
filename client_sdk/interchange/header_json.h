// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "carillon/v1/modal_model.pb.h"

namespace carillon::interchange {

/// The header as JSON with the names of the .proto, without what the arrays beside it say.
std::string ToJson(v1::ModalModelHeader header);

/// nullopt for what is no such header. Names of a later version are left out.
std::optional<v1::ModalModelHeader> HeaderFromJson(const std::string& json);

}  // namespace carillon::interchange
