// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_forces.h"

#include <algorithm>
#include <cmath>

namespace carillon {
namespace {

/// After the last force one knot brings it down to zero, and one ends the slope.
constexpr int kKnotsToEnd = 2;

Excitation Scaled(Excitation excitation, double factor) {
  for (float& component : excitation.impulse_newton_seconds) {
    component *= static_cast<float>(factor);
  }
  return excitation;
}

double Magnitude(const Excitation& excitation) {
  const auto& [x, y, z] = excitation.impulse_newton_seconds;
  return std::hypot(double{x}, double{y}, double{z});
}

}  // namespace

void ContactForces::Begin(double time_s, Push push) {
  // An engine's steps are of one length, or nearly.
  constexpr double kLongestStep = 1.5;
  for (int i = 0; i < kKnotsToEnd && time_s_ && !objects_.empty(); ++i) {
    if (time_s - *time_s_ <= kLongestStep * nominal_step_s_) break;
    step_s_ = nominal_step_s_;
    *time_s_ += step_s_;
    End(push);
  }
  const double since_s = time_s - time_s_.value_or(time_s);
  step_s_ = since_s > 0 ? std::min(since_s, kLongestStep * nominal_step_s_) : nominal_step_s_;
  time_s_ = time_s;
}

void ContactForces::Add(const FeltContact& force, const Roughness& roughness) {
  for (const Felt& felt : force.all()) {
    objects_[felt.handle].forces.push_back({felt.excitation, roughness});
  }
}

void ContactForces::Touch(const ObjectTouch& touch, const FeltContact& impulse) {
  pairs_[{touch.handle, touch.partner}].touches.push_back({impulse, touch.roughness});
}

void ContactForces::End(Push push) {
  for (auto& [key, pair] : pairs_) Divide(pair, push);
  std::erase_if(pairs_, [](const auto& pair) { return pair.second.load.idle(); });
  for (auto& [handle, object] : objects_) {
    for (const Force& force : object.forces) {
      push(handle, {.kind = StrikeKind::kForce, .excitation = force.excitation}, *time_s_);
    }
    push(handle, {.kind = StrikeKind::kKnot, .knot = Tie(object.forces, step_s_)}, *time_s_);
    object.steps_without = object.forces.empty() ? object.steps_without + 1 : 0;
    object.forces.clear();
  }
  std::erase_if(objects_,
                [](const auto& object) { return object.second.steps_without >= kKnotsToEnd; });
}

void ContactForces::Divide(Pair& pair, Push push) {
  double impulse = 0;
  for (const PairTouch& touch : pair.touches) impulse += Magnitude(touch.impulse.by[0].excitation);
  const double blow = pair.load.Next(impulse, step_s_);
  for (const PairTouch& touch : pair.touches) {
    FeltContact load = touch.impulse;
    for (Felt& felt : std::span(load.by).first(load.count)) {
      if (blow > 0) push(felt.handle, {.excitation = Scaled(felt.excitation, blow)}, *time_s_);
      felt.excitation = Scaled(felt.excitation, (1 - blow) / step_s_);
    }
    Add(load, touch.roughness);
  }
  pair.touches.clear();
}

ForceKnot ContactForces::Tie(const std::vector<Force>& forces, double step_s) {
  double load = 0, fluctuation = 0, bandwidth = 0;
  for (const auto& [excitation, roughness] : forces) {
    const double share = Magnitude(excitation);
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
