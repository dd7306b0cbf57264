// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// Returns the request for the coarse model that is computed before the model of `resolved`. It is
/// for the same body with a mesh of few nodes, without accuracy or budget. The elements are linear
/// if the size of the file suggests a fine surface. The coarse model has its own digest. Returns
/// nothing if coarse_first is not set, if the coarse model would not be quicker, or if the file may
/// hold tetrahedra, whose number cannot be reduced.
std::optional<v1::CreateModalModelRequest> CoarseRequest(
    const v1::CreateModalModelRequest& resolved, uint64_t mesh_bytes);

/// Returns whether the model that `header` describes is only the coarse model of `resolved`.
bool IsCoarseOf(const v1::ModalModelHeader& header, const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
