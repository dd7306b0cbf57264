// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstdint>
#include <deque>
#include <map>

#include "carillon/v1/contact.pb.h"

namespace carillon::adapters {

/// Reads all contacts of an ODE world with the speed at which they travel: blows, loads, slides and
/// rolls, which the daemon tells apart.
class OdeContacts {
 public:
  struct Settings {
    double roughness_depth = 0.5;  ///< as for carillon.v1.Roughness
    double grain_m = 0.001;
    double duration_s = 0.0005;  ///< of a blow
  };

  explicit OdeContacts(const Settings& settings) : settings_(settings) {}

  /// From now on `body` is heard under `handle`. Its frame must be that of its modal model.
  void AddObject(dBodyID body, uint32_t handle) { handles_[body] = handle; }

  /// Call it from the near callback for each contact joint, once it is attached; it sets the
  /// joint's feedback.
  void Add(dJointID joint, const dContactGeom& geometry);

  /// Appends the contacts of the step of `step_s` that has just been solved, and forgets them: call
  /// it after dWorldStep or dWorldQuickStep, before the joints go. A contact of two objects is one
  /// row with a second object.
  void Read(double step_s, v1::ContactStep& step);

  /// Appends where the objects are; heard in a scene that has a carillon.v1.Hearing.
  void ReadPoses(v1::ContactStep& step) const;

 private:
  using Vector = std::array<double, 3>;
  struct Contact {
    std::array<dBodyID, 2> bodies{};  // null: the world
    std::array<Vector, 2> local_point{};
    Vector normal{}, point{};
    dJointFeedback feedback{};
  };

  void Append(const Contact& contact, size_t side, double step_s, v1::ContactStep& step);
  static double TravelSpeed(const Contact& contact);

  Settings settings_;
  std::map<dBodyID, uint32_t> handles_;
  std::map<dBodyID, uint32_t> partners_;  // every body met, numbered
  std::deque<Contact> contacts_;          // ODE writes into their feedback
};

}  // namespace carillon::adapters
