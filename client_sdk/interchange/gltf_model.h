// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// Modal models as glTF 2.0 with the draft extension KHR_audio_rigid_bodies, which describes a body
/// of one material: damped frequencies in Hz, decay rates in 1/s, and mass-normalised mode shapes
/// in 1/kg^(1/2), all in single precision. README.md in this folder says which parts of a model the
/// format carries.

/// The names that a glTF gives to its parts.
struct GltfNames {
  std::string body;      ///< the name of the model, its node and its mesh
  std::string material;  ///< the name of the acoustic material
};

/// Writes `model` as it sounds with `material`, which must have every figure. Modes that the
/// material overdamps have no frequency and are left out. Errors: FailedPrecondition
/// (POISSON_RATIO_DIFFERS, NO_MODE_IN_BAND), ResourceExhausted (MODAL_MODEL_TOO_LARGE), Internal
/// (OUTPUT_NOT_WRITABLE).
absl::Status WriteGltfModel(const std::string& path, const StoredModel& model,
                            const v1::Material& material, const GltfNames& names, bool binary);

/// A modal model that was read from a glTF.
struct GltfModel {
  StoredModel model;
  std::string label;      ///< the name that the file gives to the model
  v1::Material material;  ///< the material with which the model sounds as the file says
};

/// Reads a modal model from a glTF, text or binary. `pick` is the name or the number of the model,
/// or the name of a node that sounds with it; it may be empty if the file has one model. A figure
/// of `material` overrides that of the file; one of them must be there. Errors: NotFound
/// (FILE_NOT_FOUND), InvalidArgument (MODEL_FILE_MALFORMED,
/// MODEL_FILE_AMBIGUOUS), ResourceExhausted (OUT_OF_MEMORY).
absl::StatusOr<GltfModel> ReadGltfModel(const std::string& path, const std::string& pick,
                                        const v1::Material& material);

}  // namespace carillon::interchange
