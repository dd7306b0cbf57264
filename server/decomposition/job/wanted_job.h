// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/v1/transfer.pb.h"

namespace carillon {

/// A job that a client asked for.
struct WantedJob {
  std::string digest;  ///< the job's name
  /// The resolved request. The request of a transfer has a material, size, band and limits, but no
  /// mesh.
  v1::CreateModalModelRequest request;
  std::string transfer_of{};      ///< see JobRecord::transfer_of
  std::string client{};           ///< the client that asked; see ActiveJob
  bool may_change_pinned = true;  ///< whether the client may have a pinned model changed
};

/// Returns the decomposition that a resolved request asks for.
WantedJob WantedModel(const v1::CreateModalModelRequest& resolved);

/// Returns the transfer to compute after the model of a resolved request, which is stored as
/// `model`. The model's digest and the step number of the speed ratio name the job.
WantedJob WantedTransfer(const std::string& model, const v1::CreateModalModelRequest& resolved);

/// Returns the transfer that a stored model lacks since it has replaced one for which `stored` was
/// computed.
WantedJob WantedTransfer(const std::string& model, const v1::TransferHeader& stored,
                         const std::string& label);

/// Returns the transfer of the stored model `model` that a client asks for. Errors: those of
/// ResolveUse.
absl::StatusOr<WantedJob> WantedTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request);

/// Returns the step number (SpeedStep) of the speed ratio of the material of a resolved request.
int64_t SpeedStepOf(const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
