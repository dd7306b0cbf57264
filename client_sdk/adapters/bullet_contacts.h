// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <map>

#include "carillon/v1/contact.pb.h"

namespace carillon::adapters {

/// Reads all contacts of a Bullet world as it reports them, with the speed at which they travel:
/// blows, loads, slides and rolls, which the daemon tells apart. BulletStrikes reads blows alone.
class BulletContacts {
 public:
  struct Settings {
    double roughness_depth = 0.5;  ///< as for carillon.v1.Roughness
    double grain_m = 0.001;
    double duration_s = 0.0005;  ///< of a blow
  };

  explicit BulletContacts(const Settings& settings) : settings_(settings) {}

  /// From now on `body` is heard under `handle`. Its frame must be that of its modal model.
  void AddObject(const btCollisionObject& body, uint32_t handle) { handles_[&body] = handle; }

  /// Appends the contacts of the substep that has just been solved; call it from the world's
  /// internal tick callback, with a ContactStep for each substep. A contact of two objects is one
  /// row with a second object.
  void Read(btDispatcher& dispatcher, v1::ContactStep& step);

  /// Appends where the objects are; heard in a scene that has a carillon.v1.Hearing.
  void ReadPoses(v1::ContactStep& step) const;

 private:
  /// A body of a contact, with where and what it feels, the impulse in world coordinates.
  struct Side {
    const btCollisionObject& body;
    btVector3 local_point, impulse;
  };

  void Append(const Side& a, const Side& b, double travel_speed_m_per_s, v1::ContactStep& step);

  Settings settings_;
  std::map<const btCollisionObject*, uint32_t> handles_;
  std::map<const btCollisionObject*, uint32_t> partners_;  // every body met, numbered
};

}  // namespace carillon::adapters
