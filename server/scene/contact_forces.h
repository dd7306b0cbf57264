// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "server/excitation/contact.h"
#include "server/excitation/load_tracker.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// A force that lasts on an object of the scene.
struct ObjectForce {
  uint32_t handle = 0;
  ContactImpulse force;  ///< newtons for newton seconds
  Roughness roughness;
  std::optional<SecondObject> second = std::nullopt;
};

/// A contact of an object of which it is not known whether it is a blow or a load.
struct ObjectTouch {
  uint32_t handle = 0;
  uint32_t partner = 0;      ///< names the other body
  ContactImpulse impulse{};  ///< of the whole step
  Roughness roughness{};
  std::optional<SecondObject> second = std::nullopt;
};

/// Turns the lasting contacts of one simulation, step by step, into what the mixer understands: for
/// each object that has some the forces, then a knot; and strikes where a contact was a blow. One
/// thread at a time.
class ContactForces {
 public:
  /// Takes what happens to an object at a simulation time.
  using Push =
      absl::FunctionRef<void(uint32_t handle, const MixerEvent::Action& action, double time_s)>;

  /// `step_s`: the simulator's step, seconds.
  explicit ContactForces(double step_s) : nominal_step_s_(step_s) {}

  /// Begins the step at simulation time `time_s`, not before the last. Where steps were left out,
  /// forces ended there.
  void Begin(double time_s, Push push);

  /// A force of this step, in newtons where the contact says newton seconds.
  void Add(const FeltContact& force, const Roughness& roughness);

  /// A contact of this step that is a blow or a load, N s.
  void Touch(const ObjectTouch& touch, const FeltContact& impulse);

  /// Ends the step.
  void End(Push push);

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

  /// Adds an impulse times `per_second` as a force of this step.
  void Add(const Felt& felt, double per_second, const Roughness& roughness);
  void Divide(Pair& pair, Push push);
  static ForceKnot Tie(const std::vector<Force>& forces, double step_s);

  double nominal_step_s_;
  double step_s_ = 0;  // since the step before
  std::optional<double> time_s_;
  std::map<uint32_t, Object> objects_;
  std::map<std::pair<uint32_t, uint32_t>, Pair> pairs_;
};

}  // namespace carillon
