// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// The request for the coarse model that a resolved request with coarse_first gets first: the same
/// body with a mesh of few nodes, without accuracy or budget, and with linear elements if the size
/// of the file suggests a fine surface. It has a digest of its own. Absent if the coarse model
/// would not be quicker, or if the file may hold tetrahedra, whose number is given.
std::optional<v1::CreateModalModelRequest> CoarseRequest(
    const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes);

/// Whether the model that `header` describes is only the coarse one of `resolved`.
bool IsCoarseOf(const v1::ModalModelHeader& header, const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
