// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/bullet_contacts.h"

namespace carillon::adapters {
namespace {

Vector ToArray(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

Quaternion ToArray(const btQuaternion& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// The impulse of one substep on the first body, N s, in the world: normal and friction.
btVector3 ImpulseOnFirst(const btManifoldPoint& point) {
  btVector3 impulse = point.m_normalWorldOnB * point.m_appliedImpulse +
                      point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1;
  // Bullet sets the second direction only where its solver uses it.
  if (point.m_appliedImpulseLateral2 != 0) {
    impulse += point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2;
  }
  return impulse;
}

/// `local_point` belongs to the pose in which the contact was found. `world_point` does too, but
/// the body has moved on since.
ContactSide SideOf(const btCollisionObject& object, const btVector3& local_point,
                   const btVector3& world_point, const btVector3& normal) {
  ContactSide side{.body = &object,
                   .point_m = ToArray(local_point),
                   .orientation = ToArray(object.getWorldTransform().getRotation())};
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (body == nullptr || object.isStaticObject()) return side;
  const btVector3 arm = world_point - body->getCenterOfMassPosition();
  side.velocity_m_per_s = ToArray(body->getVelocityInLocalPoint(arm));
  side.angular_velocity_rad_per_s = ToArray(body->getAngularVelocity());
  side.lever_m = btFabs(arm.dot(normal));
  if (body->getInvMass() > 0) side.mass_kg = 1 / body->getInvMass();
  return side;
}

ContactReport ReportOf(const btPersistentManifold& manifold, const btManifoldPoint& point) {
  const btVector3& normal = point.m_normalWorldOnB;
  return {.sides = {SideOf(*manifold.getBody0(), point.m_localPointA, point.getPositionWorldOnA(),
                           normal),
                    SideOf(*manifold.getBody1(), point.m_localPointB, point.getPositionWorldOnB(),
                           normal)},
          .normal = ToArray(normal),
          .impulse_on_first_newton_seconds = ToArray(ImpulseOnFirst(point))};
}

}  // namespace

void BulletContacts::Read(btDispatcher& dispatcher, v1::ContactStep& step) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold.getContactPoint(j);
      if (point.m_appliedImpulse > 0) rows_.Append(ReportOf(manifold, point), step);
    }
  }
}

void BulletContacts::ReadPoses(v1::ContactStep& step) const {
  for (const auto& [body, handle] : rows_.handles()) {
    const btTransform& pose = static_cast<const btCollisionObject*>(body)->getWorldTransform();
    rows_.AppendPose(body, ToArray(pose.getOrigin()), ToArray(pose.getRotation()), step);
  }
}

}  // namespace carillon::adapters
