// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/adapters/bullet_strikes.h"

#include "client_sdk/adapters/bullet_impulse.h"

namespace carillon::adapters {
namespace {

double NormalImpulse(const btPersistentManifold& manifold) {
  double sum = 0;
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    sum += manifold.getContactPoint(i).m_appliedImpulse;
  }
  return sum;
}

std::pair<const btCollisionObject*, const btCollisionObject*> PairOf(
    const btPersistentManifold& manifold) {
  return {manifold.getBody0(), manifold.getBody1()};
}

}  // namespace

bool BulletStrikes::IsHeard(const btPersistentManifold& manifold) const {
  return handles_.contains(manifold.getBody0()) || handles_.contains(manifold.getBody1());
}

double BulletStrikes::HeardShare(const Touch& now, const Touch& before) const {
  const double impulse = now.impulse_newton_seconds;
  const bool fresh = now.substep_count <= settings_.fresh_substeps;
  if (!fresh && impulse < settings_.min_rise * before.impulse_newton_seconds) return 0;
  const double heard = fresh ? impulse : impulse - before.impulse_newton_seconds;
  return heard < settings_.min_impulse_newton_seconds ? 0 : heard / impulse;
}

void BulletStrikes::Read(btDispatcher& dispatcher, double time_offset_s, v1::ContactStep& step) {
  // A pair may have several manifolds, and its contact points hop: the pair's sum is what is
  // steady.
  std::map<Pair, Touch> touches;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    const double impulse = NormalImpulse(manifold);
    if (!IsHeard(manifold) || impulse <= 0) continue;
    touches[PairOf(manifold)].impulse_newton_seconds += impulse;
  }
  for (auto& [pair, touch] : touches) touch.substep_count = touches_[pair].substep_count + 1;
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    const auto touch = touches.find(PairOf(manifold));
    if (touch == touches.end()) continue;
    const double share = HeardShare(touch->second, touches_[touch->first]);
    if (share > 0) ReadPair(manifold, share, time_offset_s, step);
  }
  touches_ = std::move(touches);
}

void BulletStrikes::ReadPair(const btPersistentManifold& manifold, double share,
                             double time_offset_s, v1::ContactStep& step) const {
  const btCollisionObject& a = *manifold.getBody0();
  const btCollisionObject& b = *manifold.getBody1();
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    if (point.m_appliedImpulse <= 0) continue;
    const btVector3 impulse = ImpulseOnA(point) * share;
    const double duration = settings_.duration_s(a, b, point.m_appliedImpulse * share);
    // The local points belong to the pose in which the contact was found; the world points do too,
    // but the bodies have moved on since.
    Append(a, point.m_localPointA, impulse, duration, time_offset_s, step);
    Append(b, point.m_localPointB, -impulse, duration, time_offset_s, step);
  }
}

void BulletStrikes::Append(const btCollisionObject& body, const btVector3& local_point,
                           const btVector3& impulse, double duration_s, double time_offset_s,
                           v1::ContactStep& step) const {
  const auto handle = handles_.find(&body);
  if (handle == handles_.end()) return;
  v1::Impulse& strike = *step.add_impulses();
  strike.set_object(handle->second);
  Set(*strike.mutable_point_m(), local_point);
  Set(*strike.mutable_impulse_newton_seconds(),
      body.getWorldTransform().getBasis().transpose() * impulse);
  strike.set_duration_s(duration_s);
  strike.set_time_offset_s(time_offset_s);
}

}  // namespace carillon::adapters
