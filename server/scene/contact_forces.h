// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "server/excitation/contact.h"
#include "server/excitation/load_tracker.h"
#include "server/scene/felt_contact.h"
#include "server/scene/object_contact.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// An action on an object at a simulation time.
struct ForceEvent {
  uint32_t handle = 0;
  MixerEvent::Action action{};
  double time_s = 0;
};

/// Turns the lasting contacts of one simulation into events of the mixer. Each step gives, for each
/// object under a force, the object's forces and then a knot; a contact that was a blow gives an
/// impulse, too. One thread at a time.
class ContactForces {
 public:
  using Events = std::vector<ForceEvent>;

  /// `step_s`: the simulator's step, seconds.
  explicit ContactForces(double step_s) : nominal_step_s_(step_s) {}

  /// Begins the step at simulation time `time_s`, which is not before the last step's. If steps
  /// were left out, the forces ended with the last step, and the events that end them are returned.
  Events Begin(double time_s);

  /// Adds a force to this step, with newtons in place of newton seconds.
  void Add(const FeltContact& force, const Roughness& roughness);

  /// Adds a contact to this step that may be a blow or a load. `impulse` is what the objects of
  /// `touch` feel.
  void Touch(const ObjectTouch& touch, const FeltContact& impulse);

  /// Ends the step and returns its events.
  Events End();

 private:
  struct Force {
    SurfaceForce force;
    Roughness roughness;
  };
  struct Object {
    std::vector<Force> forces;  // of this step
    int steps_without = 0;
  };
  struct PairTouch {
    FeltContact impulse;
    Roughness roughness;
  };
  struct Pair {
    LoadTracker load;
    std::vector<PairTouch> touches;  // of this step
  };

  void End(Events& events);
  /// Adds the impulse of `felt` times `per_second` as a force of this step.
  void Add(const Felt& felt, double per_second, const Roughness& roughness);
  /// Sends the touches of two bodies on: impacts as impulses, loads (see LoadTracker) as forces.
  void Divide(Pair& pair, Events& events);
  static ForceKnot MakeKnot(const std::vector<Force>& forces, double step_s);

  double nominal_step_s_;
  double step_s_ = 0;  // since the step before
  std::optional<double> time_s_;
  std::map<uint32_t, Object> objects_;
  std::map<std::pair<uint32_t, uint32_t>, Pair> pairs_;
};

}  // namespace carillon
