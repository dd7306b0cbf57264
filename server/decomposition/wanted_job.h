// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// A job that somebody asked for.
struct WantedJob {
  std::string digest;  ///< the job's name
  /// Resolved. A transfer has the use that the body is meant for: material, size, band and limits.
  v1::CreateModalModelRequest request;
  std::string transfer_of{};  ///< as JobRecord::transfer_of
  std::string client{};       ///< who asked; see ActiveJob
};

/// The decomposition that a resolved request asks for.
WantedJob WantedModel(const v1::CreateModalModelRequest& resolved);

/// The transfer that follows the model of a resolved request, which is stored as `model`. The job
/// is named by the model's digest and the step of the speed ratio.
WantedJob WantedTransfer(const std::string& model, const v1::CreateModalModelRequest& resolved);

/// The transfer of the stored model `model` that a client asks for. Errors: those of ResolveUse.
absl::StatusOr<WantedJob> WantedTransfer(const std::string& model,
                                         const v1::CreateTransferRequest& request);

/// The step of the speed ratio for the material of a resolved request.
int64_t SpeedStepOf(const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
