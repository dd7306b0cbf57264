// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <btBulletDynamicsCommon.h>

#include "carillon/v1/contact.pb.h"

namespace carillon::adapters {

inline void Set(v1::Vec3& target, const btVector3& source) {
  target.set_x(source.x());
  target.set_y(source.y());
  target.set_z(source.z());
}

inline void Set(v1::Quaternion& target, const btQuaternion& source) {
  target.set_w(source.w());
  target.set_x(source.x());
  target.set_y(source.y());
  target.set_z(source.z());
}

/// The impulse of one substep on body A, N s, in world coordinates: normal and friction.
inline btVector3 ImpulseOnA(const btManifoldPoint& point) {
  btVector3 impulse = point.m_normalWorldOnB * point.m_appliedImpulse +
                      point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1;
  // Bullet sets the second direction only where its solver uses it.
  if (point.m_appliedImpulseLateral2 != 0) {
    impulse += point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
  }
  return impulse;
}

}  // namespace carillon::adapters
