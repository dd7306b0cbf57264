// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_forces.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace carillon {
namespace {

/// After the last force one knot brings the force down to zero, and one ends the slope.
constexpr int kKnotsToEnd = 2;

std::array<float, 3> Scaled(std::array<float, 3> vector, double factor) {
  for (float& component : vector) component *= static_cast<float>(factor);
  return vector;
}

double Magnitude(const std::array<float, 3>& vector) {
  return std::hypot(double{vector[0]}, double{vector[1]}, double{vector[2]});
}

}  // namespace

ContactForces::Events ContactForces::Begin(double time_s) {
  // An engine's steps have one length, or nearly.
  constexpr double kLongestStep = 1.5;
  Events events;
  for (int i = 0; i < kKnotsToEnd && time_s_ && !objects_.empty(); ++i) {
    if (time_s - *time_s_ <= kLongestStep * nominal_step_s_) break;
    step_s_ = nominal_step_s_;
    *time_s_ += step_s_;
    End(events);
  }
  const double since_s = time_s - time_s_.value_or(time_s);
  step_s_ = since_s > 0 ? std::min(since_s, kLongestStep * nominal_step_s_) : nominal_step_s_;
  time_s_ = time_s;
  return events;
}

void ContactForces::Add(const FeltContact& force, const Roughness& roughness) {
  for (const Felt& felt : force.all()) Add(felt, 1, roughness);
}

void ContactForces::Add(const Felt& felt, double per_second, const Roughness& roughness) {
  const SurfaceImpulse& impulse = felt.impulse();
  const SurfaceForce force{.at = impulse.at,
                           .force_newtons = Scaled(impulse.impulse_newton_seconds, per_second)};
  objects_[felt.handle].forces.push_back({force, roughness});
}

void ContactForces::Touch(const ObjectTouch& touch, const FeltContact& impulse) {
  pairs_[{touch.contact.handle, touch.partner}].touches.push_back({impulse, touch.roughness});
}

ContactForces::Events ContactForces::End() {
  Events events;
  End(events);
  return events;
}

void ContactForces::End(Events& events) {
  for (auto& [key, pair] : pairs_) Divide(pair, events);
  std::erase_if(pairs_, [](const auto& pair) { return pair.second.load.idle(); });
  for (auto& [handle, object] : objects_) {
    for (const Force& force : object.forces) events.push_back({handle, force.force, *time_s_});
    events.push_back({handle, MakeKnot(object.forces, step_s_), *time_s_});
    object.steps_without = object.forces.empty() ? object.steps_without + 1 : 0;
    object.forces.clear();
  }
  std::erase_if(objects_,
                [](const auto& object) { return object.second.steps_without >= kKnotsToEnd; });
}

void ContactForces::Divide(Pair& pair, Events& events) {
  double impulse = 0;
  for (const PairTouch& touch : pair.touches) {
    impulse += Magnitude(touch.impulse.by[0].impulse().impulse_newton_seconds);
  }
  const double blow = pair.load.Next(impulse, step_s_);
  for (const PairTouch& touch : pair.touches) {
    for (const Felt& felt : touch.impulse.all()) {
      if (blow > 0) {
        SurfaceImpulse part = felt.impulse();
        part.impulse_newton_seconds = Scaled(part.impulse_newton_seconds, blow);
        events.push_back({felt.handle, part, *time_s_});
      }
      Add(felt, (1 - blow) / step_s_, touch.roughness);
    }
  }
  pair.touches.clear();
}

ForceKnot ContactForces::MakeKnot(const std::vector<Force>& forces, double step_s) {
  double load = 0, fluctuation = 0, bandwidth = 0;
  for (const auto& [force, roughness] : forces) {
    const double share = Magnitude(force.force_newtons);
    const bool travels = roughness.travel_speed_m_per_s > 0;
    load += share;
    fluctuation += travels ? share * roughness.depth : 0;
    bandwidth += share * roughness.depth * roughness.travel_speed_m_per_s / roughness.grain_m;
  }
  ForceKnot knot{.step_s = static_cast<float>(step_s)};
  if (fluctuation > 0) {
    knot.roughness = static_cast<float>(fluctuation / load);
    knot.bandwidth_hz = static_cast<float>(bandwidth / fluctuation);
  }
  return knot;
}

}  // namespace carillon
