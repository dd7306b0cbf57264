// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>

#include "carillon/v1/contact.pb.h"
#include "client_sdk/adapters/contact_rows.h"

namespace carillon::adapters {

/// Reads the contacts of a Bullet world as the engine reports them, with the speed at which each
/// travels over the surfaces. The daemon distinguishes blows, loads, slides and rolls.
class BulletContacts {
 public:
  explicit BulletContacts(const ContactSettings& settings) : rows_(settings) {}

  /// Lets `body` sound as the object `handle` of the scene from now on. The frame of the body must
  /// be that of its modal model.
  void AddObject(const btCollisionObject& body, uint32_t handle) { rows_.AddObject(&body, handle); }

  /// Lets `body` sound no more. Call it before the body is destroyed.
  void RemoveObject(const btCollisionObject& body) { rows_.RemoveObject(&body); }

  /// Appends the contacts of the substep that has just been solved. Call it from the world's
  /// internal tick callback, with a ContactStep for each substep.
  void Read(btDispatcher& dispatcher, v1::ContactStep& step);

  /// Appends the poses of the objects, which matter in a scene with a carillon.v1.Hearing.
  void ReadPoses(v1::ContactStep& step) const;

 private:
  ContactRows rows_;
};

}  // namespace carillon::adapters
