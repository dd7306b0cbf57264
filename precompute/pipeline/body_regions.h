// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/fem/body_materials.h"
#include "precompute/mesh/mesh_names.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// The materials of a body, and for each region of its file the number of the region's.
struct RegionMaterials {
  BodyMaterials materials;
  std::vector<int32_t> material_of_region = {};
};

/// Returns the materials of a body, relative to the reference of the completed `request`. A region
/// has the material that the request names for it, or for its material in the file, or for all
/// others. If the request names no region, there is one material for the whole body. Errors:
/// MESH_REGION_UNKNOWN (a region without a material, or a material without a region),
/// MESH_ELEMENT_UNSUPPORTED (the file has sections of several materials, and the request names no
/// region).
absl::StatusOr<RegionMaterials> MaterialsOf(const worker::v1::WorkerRequest& request,
                                            const MeshNames& names);

/// Gives a resolved material the reference of a stored model, which `material` may have scaled.
/// Errors: REGION_MATERIAL_DIFFERS (a region has no material, or the factors of two regions
/// differ).
absl::Status TakeReference(const ModalModel& model, v1::Material& material);

}  // namespace carillon::precompute
