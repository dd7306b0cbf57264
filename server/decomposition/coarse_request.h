// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// What a resolved request with coarse_first is to have first: the same body with a mesh of few
/// nodes, whatever accuracy or budget was asked for, and of linear elements where the surface
/// itself is fine, to go by the file's size. It has a name of its own, as any request. Nothing
/// where that would not be quicker, or the file may hold tetrahedra, which cannot be made fewer.
std::optional<v1::CreateModalModelRequest> CoarseRequest(
    const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes);

/// Whether the model that `header` describes is only the coarse one of `resolved`.
bool IsCoarseOf(const v1::ModalModelHeader& header, const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
