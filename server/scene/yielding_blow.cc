// SPDX-License-Identifier: Apache-2.0
#include "server/scene/yielding_blow.h"

#include <cmath>
#include <cstddef>
#include <vector>

namespace carillon {
namespace {

/// Returns the displacement phi(x) . n of a mode at the point and along the direction of a blow.
double ShapeAlong(const ModalModel& model, size_t column, const SurfaceImpulse& blow) {
  double along = 0;
  for (size_t corner = 0; corner < blow.at.vertices.size(); ++corner) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t row = size_t{3} * blow.at.vertices[corner] + axis;
      along += double{blow.at.weights[corner]} * blow.impulse_newton_seconds[axis] *
               model.shapes[row * model.mode_count() + column];
    }
  }
  return along;
}

}  // namespace

void LetYield(const SoundingObject& object, const Collision& collision, SurfaceImpulse& blow) {
  const double impulse = std::hypot(blow.impulse_newton_seconds[0], blow.impulse_newton_seconds[1],
                                    blow.impulse_newton_seconds[2]);
  if (!(collision.reduced_mass_kg > 0) || !(impulse > 0) || blow.pulse.gaussian()) return;
  std::vector<StruckMode> modes;
  modes.reserve(object.yielding->modes.size());
  for (const YieldingModes::Mode& mode : object.yielding->modes) {
    const double shape =
        object.yielding->shape_scale / impulse * ShapeAlong(*object.body->model, mode.column, blow);
    modes.push_back({.damped_rad_per_s = double{mode.damped_rad_per_s},
                     .decay_rate_per_s = double{mode.decay_rate_per_s},
                     .shape_squared_per_kg = shape * shape});
  }
  blow.gains = YieldingGains(modes, collision, impulse, double{blow.pulse.duration_s()});
}

}  // namespace carillon
