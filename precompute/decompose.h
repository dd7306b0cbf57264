// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "precompute/decomposition_observer.h"
#include "precompute/fem/element.h"
#include "precompute/intended_use.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/mesh/hold.h"
#include "precompute/mesh/surface/prepare_surface.h"
#include "precompute/modes/modal_model.h"
#include "precompute/resolution.h"

namespace carillon::precompute {

/// A mesh file: a surface or tetrahedra, see ReadMesh.
struct MeshFile {
  std::string path;
  std::string format;
  double metres_per_unit = 1;
};

struct DecompositionSettings {
  double poisson_ratio = 0;
  MassSharing mass = MassSharing::kConsistent;
  /// Where the body is held; none: it is free.
  std::vector<Fixture> fixtures = {};
  /// How to fill a surface; its nodes_per_element holds for tetrahedra given, too.
  PreparationSettings preparation;
  MeshingSettings meshing;
  IntendedUse use;
  /// Above `meshing`'s count of nodes.
  ResolutionGoal resolution;
  /// Above zero: keep only so many modes, see KeepMostAudible; then more may be found.
  int keep_mode_count = 0;
  /// Where to write K.mtx and M.mtx, SI, for the material of `use`; empty: nowhere.
  std::string matrices_folder;
};

/// From a mesh file to the modal model of the body, with every deformation mode up to the top of
/// the band that `settings.use` names. With a resolution goal a surface is filled and solved again,
/// finer each time, until the goal is met or as far as it allows; the model's warnings say where
/// the accuracy asked for was not reached, or a budget was overrun.
///
/// Errors: those of ReadMesh, CheckSurface, Tetrahedralize, Hold and SolveDeformationModes;
/// NO_MODE_IN_BAND with the figure first_mode_hz; INVALID_SETTINGS (linear elements asked of a mesh
/// of ten-node ones); OUTPUT_NOT_WRITABLE. The mesher may also crash the process.
absl::StatusOr<ModalModel> Decompose(const MeshFile& file, const DecompositionSettings& settings,
                                     DecompositionObserver& observer);

}  // namespace carillon::precompute
