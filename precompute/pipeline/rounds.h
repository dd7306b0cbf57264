// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/body.h"
#include "precompute/pipeline/decomposition_observer.h"
#include "precompute/pipeline/phase_clock.h"
#include "precompute/pipeline/resolution.h"
#include "precompute/pipeline/solve_body.h"

namespace carillon::precompute {

/// Fills and solves a surface finer and finer until the request's goal is met, or else the usual
/// goal. The later meshes are graded if the request has a goal. Objects referred to must outlive
/// this one.
class Rounds {
 public:
  Rounds(const Fillable& surface, const worker::v1::WorkerRequest& request,
         DecompositionObserver& observer);

  /// Returns the model of the best mesh. If no mode can lie in the band, the model is that of the
  /// first mesh that shows this, and has no modes. Errors: those of the first round, Fill and
  /// SolveBody. Call it once.
  absl::StatusOr<ModalModel> Run();

 private:
  enum class Next {
    kFinerMesh,
    kUniformMesh,  ///< of the size just tried, because the graded mesh was no better
    kNothing,
  };

  std::optional<ModalModel> TooSmall() const;
  absl::StatusOr<Solved> SolveNext();
  Next Plan(const Solved& solved);

  const Fillable& surface_;
  const worker::v1::WorkerRequest& request_;
  DecompositionObserver& observer_;
  const bool is_free_;
  const ResolutionGoal asked_;
  MeshingSettings meshing_;    ///< of the next mesh
  RoundForecast forecast_;     ///< of the next round
  PhaseClock::Times begun_{};  ///< when the round began
  std::vector<Round> rounds_;
};

}  // namespace carillon::precompute
