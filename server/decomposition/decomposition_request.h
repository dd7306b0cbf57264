// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// A request with every default filled in: material resolved to its figures, Poisson's ratio (from
/// the material where the settings leave it zero) rounded to 1e-4, element, mass matrix, metres per
/// unit, size and the lower end of the band. A band without an upper end stays open.
/// Errors: InvalidArgument (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL,
/// MESH_FORMAT_UNKNOWN), NotFound (MESH_NOT_FOUND: mesh_digest is no digest).
absl::StatusOr<v1::CreateModalModelRequest> ResolveRequest(
    const v1::CreateModalModelRequest& request);

/// Fills in and checks everything in a request but its mesh and its settings: material, size, band,
/// priority, limits, label and the settings of the transfer. Errors: InvalidArgument
/// (INVALID_SETTINGS, UNKNOWN_MATERIAL, INVALID_MATERIAL).
absl::Status ResolveUse(v1::CreateModalModelRequest& request);

/// The text that names the modal model of a resolved request: one "key value" a line, in this
/// order. Two requests have the same model exactly if they have the same text; the hints (material,
/// size, frequencies) and the label are not part of it.
///
///     carillon-decomposition 1
///     mesh <SHA-256 of the mesh file>
///     format <obj|ply|stl|off|msh|mesh|node>
///     ...      the lines of SettingsText
std::string CanonicalText(const v1::CreateModalModelRequest& resolved);

/// SHA-256 of CanonicalText.
std::string RequestDigest(const v1::CreateModalModelRequest& resolved);

/// The eigenvalue, for unit material and size, of a natural frequency with the material and size of
/// the hints: Lambda = (2 pi f)^2 rho s^2 / E, the scaling law of modal_model.proto.
double UnitEigenvalue(const v1::CreateModalModelRequest& resolved, double frequency_hz);

/// Whether the request leaves the upper end of the band open, so that a costly body may get a lower
/// one than WantedEigenvalue().
bool LeavesBandOpen(const v1::CreateModalModelRequest& resolved);

/// Eigenvalue up to which modes are wanted: that of the maximal frequency, or of 20 kHz where the
/// band is open.
double WantedEigenvalue(const v1::CreateModalModelRequest& resolved);

}  // namespace carillon
