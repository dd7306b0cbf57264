// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/statusor.h"
#include "carillon/worker/v1/worker.pb.h"
#include "precompute/modes/modal_model.h"
#include "precompute/pipeline/body.h"
#include "precompute/pipeline/decomposition_observer.h"

namespace carillon::precompute {

/// A body, its model, and the processor time that was predicted for it, which is the same on each
/// machine.
struct Solved {
  Body body;
  ModalModel model;
  double predicted_cpu_s = 0;
};

/// Computes the model of one body: its matrices, their modes, and what they mean for the surface.
/// Errors: those of SolveDeformationModes.
absl::StatusOr<Solved> SolveBody(Body body, const worker::v1::WorkerRequest& request,
                                 DecompositionObserver& observer);

/// Compares the modes of a mesh of few elements with those of a mesh of ordinary elements: of the
/// surface, if the body has one that can be filled, or of the mesh's divided elements.
void CheckFewElements(const Fillable* surface, const worker::v1::WorkerRequest& request,
                      Solved& solved);

/// Returns whether the request leaves the fineness of the mesh to the program. Linear elements are
/// left as they are, because they serve comparisons.
bool IsFinenessFree(const worker::v1::WorkerRequest& request);

}  // namespace carillon::precompute
