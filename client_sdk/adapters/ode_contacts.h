// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ode/ode.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "carillon/v1/contact.pb.h"
#include "client_sdk/adapters/contact_rows.h"

namespace carillon::adapters {

/// Reads the contacts of an ODE world as the engine reports them, with the speed at which each
/// travels over the surfaces. The daemon distinguishes blows, loads, slides and rolls.
class OdeContacts {
 public:
  explicit OdeContacts(const ContactSettings& settings) : rows_(settings) {}

  /// Lets `body` sound as the object `handle` of the scene from now on. The frame of the body must
  /// be that of its modal model.
  void AddObject(dBodyID body, uint32_t handle) { rows_.AddObject(body, handle); }

  /// Lets `body` sound no more. Call it before the body is destroyed.
  void RemoveObject(dBodyID body) { rows_.RemoveObject(body); }

  /// Remembers a contact joint and sets its feedback. Call it from the near callback for each
  /// contact joint, after the joint has been attached.
  void Add(dJointID joint, const dContactGeom& geometry);

  /// Appends the contacts of the step of `step_s` seconds that has just been solved, and forgets
  /// them. Call it after dWorldStep or dWorldQuickStep, before the joints are destroyed.
  void Read(double step_s, v1::ContactStep& step);

  /// Appends the poses of the objects, which matter in a scene with a carillon.v1.Hearing.
  void ReadPoses(v1::ContactStep& step) const;

 private:
  struct Contact {
    std::array<dBodyID, 2> bodies{};  // null: the world
    std::array<Vector, 2> local_points{};
    Vector normal{}, point{};
    dJointFeedback feedback{};
  };

  static ContactSide SideOf(const Contact& contact, size_t side);

  ContactRows rows_;
  std::deque<Contact> contacts_;  // ODE writes into their feedback
};

}  // namespace carillon::adapters
