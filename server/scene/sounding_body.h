// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <future>
#include <map>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/base/pose.h"
#include "server/excitation/sharp_edges.h"
#include "server/excitation/surface_curvature.h"
#include "server/excitation/surface_locator.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/synthesis/bank/shape_table.h"

namespace carillon {

/// A modal model, its mode shapes as a table for projecting impulses, and the index that finds
/// points on its surface. All objects of one shape share a body.
struct SoundingBody {
  std::shared_ptr<const ModalModel> model;
  ShapeTable shapes;
  std::unique_ptr<const SurfaceLocator> locator;
  SurfaceCurvature curvature;  ///< curvature of the surface as given
  SharpEdges edges;            ///< edges of the surface as given
  /// Volume at the model's size, or zero if unknown. For a body of several materials, the volume of
  /// the reference material that has the body's mass.
  double volume_m3 = 0;
  /// Centre of mass of a body of one material at the model's size.
  std::array<double, 3> centre_m{};
  /// The lower triangular root L of the tensor of inertia L L^T about the centre, at the model's
  /// size and for unit density, m^2.5; zero if unknown.
  std::array<Vector3, 3> inertia_root{};
  double extent_m = 0;  ///< the diagonal of the bounding box at the model's size

  /// Returns a point of the sounding surface, in the model's frame and size, metres.
  Point At(const LocatedPoint& located) const;
};

/// Makes the body of a model once, and returns the same body as long as any object uses it. Safe
/// from every thread.
class BodyCache {
 public:
  /// Returns the body of a model. Errors: InvalidArgument or FailedPrecondition
  /// (MODAL_MODEL_MALFORMED).
  absl::StatusOr<std::shared_ptr<const SoundingBody>> Get(std::shared_ptr<const ModalModel> model);

 private:
  using Made = absl::StatusOr<std::shared_ptr<const SoundingBody>>;

  Mutex mutex_;
  std::map<const ModalModel*, std::weak_ptr<const SoundingBody>> bodies_ ABSL_GUARDED_BY(mutex_);
  /// The bodies that are being made. Whoever asks for one of them meanwhile waits for it.
  std::map<const ModalModel*, std::shared_future<Made>> making_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
