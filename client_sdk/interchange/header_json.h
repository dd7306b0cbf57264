// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "carillon/v1/modal_model.pb.h"

namespace carillon::interchange {

/// Returns the header as JSON with the field names of the .proto, without the fields that describe
/// the arrays.
std::string ToJson(v1::ModalModelHeader header);

/// Returns the header that such a JSON text describes, or nullopt if the text describes none.
/// Fields of a later version are left out.
std::optional<v1::ModalModelHeader> HeaderFromJson(const std::string& json);

}  // namespace carillon::interchange
