// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/intended_use.h"

namespace carillon::precompute {

/// Refuses a body, in a file whose unit nobody has stated, that is so long that the unit was
/// probably forgotten: longer than 20 m and than a hundred wavelengths of the band's upper end.
/// Errors: MESH_UNIT_UNCLEAR.
absl::Status CheckUnit(double extent_m, const IntendedUse& use);

/// Warns of a body, in a file whose unit nobody has stated, that is longer than 3 m.
void WarnOfUnit(double extent_m, const IntendedUse& use, std::vector<std::string>& warnings);

/// Returns whether a body may be too small to have a mode in the band, and is so compact that its
/// default mesh takes long.
bool MayBeTooSmall(const SurfaceMesh& surface, const IntendedUse& use);

/// Returns whether no finer mesh can have a mode in the band: the lowest mode lies above the band
/// by more than twice its estimated error. A coarse mesh shows this as well as a fine mesh does,
/// because its frequencies are only a little too high.
bool IsSurelyAboveBand(const ModalModel& model, const IntendedUse& use);

/// Returns OK if a mode lies in the band of `use`.
/// Errors: NO_MODE_IN_BAND with the figure first_mode_hz.
absl::Status CheckBand(const ModalModel& model, const IntendedUse& use);

/// Leaves out the modes whose estimated error is above `limit`, and adds a warning that says so. A
/// limit of zero leaves out none.
/// Errors: ACCURACY_NOT_REACHED, if no mode remains.
absl::Status LeaveOutInaccurate(double limit, const IntendedUse& use, ModalModel& model);

}  // namespace carillon::precompute
