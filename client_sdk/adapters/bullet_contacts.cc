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
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold.getContactPoint(j);
      if (point.m_appliedImpulse <= 0) continue;
      const btVector3 impulse = ImpulseOnA(point);
      const Side a{*manifold.getBody0(), point.m_localPointA, impulse};
      const Side b{*manifold.getBody1(), point.m_localPointB, -impulse};
      Append(a, b, TravelSpeed(point, a.body, b.body), step);
    }
  }
}

void BulletContacts::Append(const Side& a, const Side& b, double travel_speed_m_per_s,
                            v1::ContactStep& step) {
  const auto heard_a = handles_.find(&a.body), heard_b = handles_.find(&b.body);
  const bool has_a = heard_a != handles_.end(), has_b = heard_b != handles_.end();
  if (!has_a && !has_b) return;
  // Always the same of a pair comes first, however Bullet orders them.
  if (!has_a || (has_b && heard_b->second < heard_a->second)) {
    return Append(b, a, travel_speed_m_per_s, step);
  }
  const auto next = static_cast<uint32_t>(partners_.size());
  v1::EngineContact& contact = *step.add_contacts();
  contact.set_object(heard_a->second);
  contact.set_partner(partners_.try_emplace(&b.body, next).first->second);
  Set(*contact.mutable_point_m(), a.local_point);
  const btMatrix3x3& turned = a.body.getWorldTransform().getBasis();
  Set(*contact.mutable_impulse_newton_seconds(), turned.transpose() * a.impulse);
  contact.set_duration_s(settings_.duration_s);
  v1::Roughness& roughness = *contact.mutable_roughness();
  roughness.set_travel_speed_m_per_s(travel_speed_m_per_s);
  roughness.set_depth(settings_.roughness_depth);
  roughness.set_grain_m(settings_.grain_m);
  if (!has_b) return;
  v1::SecondObject& second = *contact.mutable_second();
  second.set_object(heard_b->second);
  Set(*second.mutable_point_m(), b.local_point);
  btQuaternion rotation;
  (b.body.getWorldTransform().getBasis().transpose() * turned).getRotation(rotation);
  Set(*second.mutable_rotation(), rotation);
}

void BulletContacts::ReadPoses(v1::ContactStep& step) const {
  for (const auto& [body, handle] : handles_) {
    v1::ObjectPose& pose = *step.add_poses();
    pose.set_object(handle);
    Set(*pose.mutable_pose()->mutable_position_m(), body->getWorldTransform().getOrigin());
    Set(*pose.mutable_pose()->mutable_orientation(), body->getWorldTransform().getRotation());
  }
}

}  // namespace carillon::adapters
