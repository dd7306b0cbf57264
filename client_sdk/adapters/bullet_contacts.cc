// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/bullet_contacts.h"

#include "client_sdk/adapters/bullet_impulse.h"

namespace carillon::adapters {
namespace {

struct Motion {
  btVector3 velocity{0, 0, 0};  // of the body's material at the contact
  btVector3 angular_velocity{0, 0, 0};
  btScalar lever_m = 0;  // from the contact to the centre of mass, along the normal
};

Motion MotionAt(const btCollisionObject& object, const btVector3& point, const btVector3& normal) {
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (body == nullptr || object.isStaticObject()) return {};
  const btVector3 arm = point - body->getCenterOfMassPosition();
  return {body->getVelocityInLocalPoint(arm), body->getAngularVelocity(), btFabs(arm.dot(normal))};
}

btVector3 Tangential(const btVector3& vector, const btVector3& normal) {
  return vector - normal * vector.dot(normal);
}

/// Of a slide the speed of one surface over the other; of a roll that of the contact, which a body
/// with its centre of mass at distance R leaves behind at omega R.
double TravelSpeed(const btManifoldPoint& point, const btCollisionObject& a,
                   const btCollisionObject& b) {
  const btVector3& normal = point.m_normalWorldOnB;
  const Motion on_a = MotionAt(a, point.getPositionWorldOnA(), normal);
  const Motion on_b = MotionAt(b, point.getPositionWorldOnB(), normal);
  const btVector3 slip = Tangential(on_a.velocity - on_b.velocity, normal);
  const btVector3 roll = Tangential(on_a.angular_velocity - on_b.angular_velocity, normal);
  return slip.length() + roll.length() * btMax(on_a.lever_m, on_b.lever_m);
}

}  // namespace

void BulletContacts::Read(btDispatcher& dispatcher, v1::ContactStep& step) {
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    const btCollisionObject& a = *manifold.getBody0();
    const btCollisionObject& b = *manifold.getBody1();
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold.getContactPoint(j);
      if (point.m_appliedImpulse <= 0) continue;
      const btVector3 impulse = ImpulseOnA(point);
      const double speed = TravelSpeed(point, a, b);
      Append(a, b, point.m_localPointA, impulse, speed, step);
      Append(b, a, point.m_localPointB, -impulse, speed, step);
    }
  }
}

void BulletContacts::Append(const btCollisionObject& body, const btCollisionObject& other,
                            const btVector3& local_point, const btVector3& impulse,
                            double travel_speed_m_per_s, v1::ContactStep& step) {
  const auto handle = handles_.find(&body);
  if (handle == handles_.end()) return;
  const auto next = static_cast<uint32_t>(partners_.size());
  v1::EngineContact& contact = *step.add_contacts();
  contact.set_object(handle->second);
  contact.set_partner(partners_.try_emplace(&other, next).first->second);
  Set(*contact.mutable_point_m(), local_point);
  Set(*contact.mutable_impulse_newton_seconds(),
      body.getWorldTransform().getBasis().transpose() * impulse);
  contact.set_duration_s(settings_.duration_s);
  v1::Roughness& roughness = *contact.mutable_roughness();
  roughness.set_travel_speed_m_per_s(travel_speed_m_per_s);
  roughness.set_depth(settings_.roughness_depth);
  roughness.set_grain_m(settings_.grain_m);
}

}  // namespace carillon::adapters
