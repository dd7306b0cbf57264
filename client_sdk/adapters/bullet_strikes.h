// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "carillon/v1/contact.pb.h"

namespace carillon::adapters {

/// Reads out of a Bullet world what strikes its sounding bodies.
///
/// Bullet reports the load of a resting contact as an impulse in every substep; played as strikes
/// that would be a drone. Of a pair of bodies this is heard: all impulses of its first
/// `fresh_substeps` of touch, over which Bullet spreads a collision, and after these only a rise
/// above `min_rise` times the substep before. Less than `min_impulse_newton_seconds` is not heard.
/// A substep without an impulse ends the touch: when a body bounces, each landing is fresh.
class BulletStrikes {
 public:
  struct Settings {
    double min_impulse_newton_seconds = 1e-4;
    double min_rise = 1.5;
    int fresh_substeps = 3;
    /// How long a contact of two bodies lasts, seconds, given its impulse in N s.
    std::function<double(const btCollisionObject&, const btCollisionObject&, double)> duration_s;
  };

  explicit BulletStrikes(Settings settings) : settings_(std::move(settings)) {}

  /// From now on `body` is heard under `handle`. Its frame must be that of its modal model.
  void AddObject(const btCollisionObject& body, uint32_t handle) { handles_[&body] = handle; }

  /// Appends the strikes of the substep that has just been solved; call it from the world's
  /// internal tick callback. `time_offset_s` is the substep's time within `step`.
  void Read(btDispatcher& dispatcher, double time_offset_s, v1::ContactStep& step);

 private:
  using Pair = std::pair<const btCollisionObject*, const btCollisionObject*>;

  /// The normal impulse of a pair in one substep, and for how many substeps it has touched.
  struct Touch {
    double impulse_newton_seconds = 0;
    int substep_count = 0;
  };

  /// The part of a pair's impulse that is heard, 0 to 1.
  double HeardShare(const Touch& now, const Touch& before) const;
  void ReadPair(const btPersistentManifold& manifold, double share, double time_offset_s,
                v1::ContactStep& step) const;
  void Append(const btCollisionObject& body, const btVector3& local_point, const btVector3& impulse,
              double duration_s, double time_offset_s, v1::ContactStep& step) const;
  bool IsHeard(const btPersistentManifold& manifold) const;

  Settings settings_;
  std::map<const btCollisionObject*, uint32_t> handles_;
  /// The pairs that touched in the substep before.
  std::map<Pair, Touch> touches_;
};

}  // namespace carillon::adapters
