// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "precompute/eigen/eigensolver.h"
#include "precompute/fem/body_materials.h"
#include "precompute/mesh/surface_mesh.h"
#include "precompute/mesh/tet_mesh.h"
#include "precompute/modes/modal_model.h"

namespace carillon::precompute {

/// Returns the parts of each mode's strain energy, phi^T K_r phi / phi^T K phi, and of its kinetic
/// energy, phi^T M_r phi / phi^T M phi, that each region r of the body has. K_r and M_r are the
/// matrices of its elements alone.
///
/// If the losses of the regions are small, the loss factor of a mode is the mean of theirs,
/// weighted by the parts of the strain energy (Ungar and Kerwin, Loss factors of viscoelastic
/// systems in terms of energy concepts, J. Acoust. Soc. Am. 34, 1962). `shapes` of the modes
/// include all nodes.
std::vector<ModelRegion> RegionEnergies(const TetMesh& mesh, const BodyMaterials& materials,
                                        const Modes& modes);

/// Returns for each triangle of `given`, to which the boundary of the mesh refers, the region of an
/// element that it bounds.
std::vector<uint8_t> GivenTriangleRegions(const TetMesh& mesh, const SurfaceMesh& given);

/// Returns the mass, kg, its first moments x, y and z, kg m, and its second moments xx, yy, zz, xy,
/// yz and zx, kg m^2, about the origin. Curved elements count as straight.
std::vector<double> MassMoments(const TetMesh& mesh, const BodyMaterials& materials);

}  // namespace carillon::precompute
