// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// Returns the request with all defaults filled in: the figures of the material, Poisson's ratio
/// rounded to 1e-4, element, mass matrix, metres per unit, size and the lower end of the band. A
/// Poisson's ratio of zero is replaced by the material's. A band without an upper end stays open.
/// Errors: InvalidArgument (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL,
/// MESH_FORMAT_UNKNOWN), NotFound (MESH_NOT_FOUND: mesh_digest is not a digest).
absl::StatusOr<v1::CreateModalModelRequest> ResolveRequest(
    const v1::CreateModalModelRequest& request);

/// Fills in and checks the material, size, band, priority, limits, label and transfer settings of a
/// request, but not its mesh and its decomposition settings. Errors: InvalidArgument
/// (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL).
absl::Status ResolveUse(v1::CreateModalModelRequest& request);

/// Returns the text that identifies the modal model of a resolved request, with one "key value" on
/// each line, in this order. Two requests have the same model if, and only if, they have the same
/// text. The text contains neither the hints (material, size, frequencies) nor the label.
///
///     carillon-decomposition 1
///     mesh <SHA-256 of the mesh file>
///     format <a name in kMeshFormats>
///     ...      the lines of SettingsText
std::string CanonicalText(const v1::CreateModalModelRequest& resolved);

/// Returns the SHA-256 of CanonicalText.
std::string RequestDigest(const v1::CreateModalModelRequest& resolved);

/// Returns the eigenvalue for unit material and size that has this natural frequency with the
/// material and size of the hints: Lambda = (2 pi f)^2 rho s^2 / E (modal_model.proto).
double UnitEigenvalue(const v1::CreateModalModelRequest& resolved, double frequency_hz);

/// Returns whether the request leaves the upper end of the band open. The band of a costly body may
/// then end below WantedEigenvalue().
bool LeavesBandOpen(const v1::CreateModalModelRequest& resolved);

/// Returns the eigenvalue up to which modes are wanted, which is that of the maximal frequency, or
/// of 20 kHz if the band is open.
double WantedEigenvalue(const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
