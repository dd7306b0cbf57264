// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Modal models as glTF 2.0 with the draft extension KHR_audio_rigid_bodies, of a body of a certain
/// material: damped frequencies in Hz, decay rates in 1/s, mass-normalised shapes in 1/kg^(1/2),
/// all in single precision. README.md here says what of a model it carries.

/// What a glTF says beside the model.
struct GltfNames {
  std::string body;      ///< of the model, its node and its mesh
  std::string material;  ///< of the acoustic material
};

/// Writes `model` as it sounds with `material`, every figure of which must be there; modes that it
/// overdamps have no frequency and are left out. Errors: FailedPrecondition (POISSON_RATIO_DIFFERS,
/// NO_MODE_IN_BAND), ResourceExhausted (MODEL_FILE_TOO_LARGE), Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteGltfModel(const std::string& path, const StoredModel& model,
                            const v1::Material& material, const GltfNames& names, bool binary);

/// What is read of a glTF.
struct GltfModel {
  StoredModel model;
  std::string label;      ///< the modal model's name
  v1::Material material;  ///< with which it sounds as the file says
};

/// Reads a modal model of a glTF, text or binary. `pick` is its name or number, or the name of a
/// node that sounds with it; empty: the only one. Figures of `material` go before those of the
/// file, which must not be missing in both. Errors: NotFound (FILE_NOT_FOUND), InvalidArgument
/// (MODEL_FILE_MALFORMED, MODEL_FILE_INCOMPLETE, MODEL_FILE_AMBIGUOUS), ResourceExhausted
/// (OUT_OF_MEMORY).
absl::StatusOr<GltfModel> ReadGltfModel(const std::string& path, const std::string& pick,
                                        const v1::Material& material);

}  // namespace carillon::interchange
