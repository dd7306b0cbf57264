// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/transfer.pb.h"

namespace carillon {

/// Checks the figures in the header of an imported model that nothing computes with, but that
/// people and clients are shown. A figure that is unknown may be zero or empty. Errors:
/// InvalidArgument (MODAL_MODEL_MALFORMED: the volume, complete_to_eigenvalue, an estimated error,
/// their number, or the mesh's digest is impossible).
absl::Status CheckFigures(const v1::ModalModelHeader& header);

/// The same for the header of an imported transfer, with which modes and directions are computed.
/// Errors: InvalidArgument (TRANSFER_MALFORMED: the radius, the air's density or speed of sound, or
/// the mesh's digest is impossible).
absl::Status CheckFigures(const v1::TransferHeader& header);

}  // namespace carillon
