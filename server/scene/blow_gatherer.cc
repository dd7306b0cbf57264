// SPDX-License-Identifier: Apache-2.0
#include "server/scene/blow_gatherer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

namespace carillon {
namespace {

/// After the last force, one knot brings the force down to zero, and another ends the slope.
constexpr int kKnotsToEnd = 2;
constexpr double kLongestStep = StepIntervals::kLongestStep;
constexpr double kLongestBlowS = 0.04;
/// A force that hardly changes for this time is a load.
constexpr double kLoadS = 0.01;
/// Blows that are farther apart than this are heard one by one, not as a tone.
constexpr double kLastingS = 0.1;
/// A client has made a mistake if kManyChanges steps have no common partner, and if these steps are
/// the share kMostChanges of the steps in contact.
constexpr uint64_t kManyChanges = 10;
constexpr double kMostChanges = 0.8;

std::array<float, 3> Scaled(std::array<float, 3> vector, double factor) {
  for (float& component : vector) component *= static_cast<float>(factor);
  return vector;
}

double Magnitude(const std::array<float, 3>& vector) {
  return std::hypot(double{vector[0]}, double{vector[1]}, double{vector[2]});
}

/// Returns a number from 0 to 1 that looks random but depends only on the arguments, by
/// SplitMix64's finalizer.
double Share(double time_s, uint32_t handle, uint32_t partner) {
  const auto mix = [](uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EB;
    return x ^ (x >> 31);
  };
  const uint64_t bodies = uint64_t{handle} << 32 | partner;
  return static_cast<double>(mix(mix(std::bit_cast<uint64_t>(time_s)) ^ bodies) >> 11) * 0x1p-53;
}

}  // namespace

BlowGatherer::Events BlowGatherer::Begin(double time_s) {
  Events events;
  const double since_s = time_s - time_s_.value_or(time_s);
  follows_ = time_s_ && since_s <= kLongestStep * nominal_step_s_;
  if (time_s_ && !follows_) {
    const double missing_count = std::ceil(since_s / nominal_step_s_ - kLongestStep);
    EndBeforeGap(std::min<double>(missing_count, LoadTracker::kStepCount), events);
  }
  step_s_ = follows_ && since_s > 0 ? since_s : nominal_step_s_;
  previous_time_s_ = std::exchange(time_s_, time_s);
  return events;
}

void BlowGatherer::EndBeforeGap(double missing_count, Events& events) {
  int steps = 0;
  step_s_ = nominal_step_s_;
  for (; steps < std::min<double>(missing_count, kKnotsToEnd) && (!objects_.empty() || gathers());
       ++steps) {
    *time_s_ += step_s_;
    End(events);
  }
  for (; steps < missing_count; ++steps) {
    for (auto& [bodies, pair] : pairs_) pair.load.Next(0, step_s_);
  }
}

void BlowGatherer::Add(const FeltContact& force, const Roughness& roughness) {
  for (const Felt& felt : force.all()) Add(felt, 1, roughness);
}

void BlowGatherer::Add(const Felt& felt, double per_second, const Roughness& roughness) {
  const SurfaceImpulse& impulse = felt.impulse();
  const SurfaceForce force{.at = impulse.at,
                           .force_newtons = Scaled(impulse.impulse_newton_seconds, per_second)};
  Object& object = objects_[felt.handle];
  // The forces on an object that had this handle before have gone with that object.
  if (object.serial != felt.serial) object = {.serial = felt.serial, .forces = {}};
  object.forces.push_back({force, roughness});
}

bool BlowGatherer::HasRoom(const ObjectTouch& touch) const {
  return touch_count_ < kMostTouches &&
         (pairs_.size() < kMostTouches || pairs_.contains({touch.contact.handle, touch.partner}));
}

void BlowGatherer::Touch(const ObjectTouch& touch, const FeltContact& impulse) {
  ++touch_count_;
  pairs_[{touch.contact.handle, touch.partner}].touches.push_back(
      {impulse, touch.roughness, touch.time_offset_s, touch.partner});
}

BlowGatherer::Events BlowGatherer::End() {
  Events events;
  End(events);
  return events;
}

void BlowGatherer::End(Events& events) {
  touch_count_ = 0;
  if (follows_) CountPartners();
  for (auto& [bodies, pair] : pairs_) Divide(bodies, pair, events);
  std::erase_if(pairs_,
                [](const auto& pair) { return pair.second.load.idle() && !pair.second.blow; });
  for (auto& [handle, object] : objects_) {
    for (const Force& force : object.forces) {
      events.push_back({handle, object.serial, force.force, *time_s_});
    }
    events.push_back({handle, object.serial, MakeKnot(object.forces, step_s_), *time_s_});
    object.steps_without = object.forces.empty() ? object.steps_without + 1 : 0;
    object.forces.clear();
  }
  std::erase_if(objects_,
                [](const auto& object) { return object.second.steps_without >= kKnotsToEnd; });
}

void BlowGatherer::CountPartners() {
  std::set<uint32_t> changed;
  bool stay = false, change_again = false;
  for (auto pair = pairs_.begin(); pair != pairs_.end();) {
    const uint32_t handle = pair->first.first;
    bool touches = false, touched = false, stays = false;
    for (; pair != pairs_.end() && pair->first.first == handle; ++pair) {
      const bool now = std::ranges::any_of(pair->second.touches, [](const PairTouch& touch) {
        return Magnitude(touch.impulse.by[0].impulse().impulse_newton_seconds) > 0;
      });
      const bool before = pair->second.touched_s && pair->second.touched_s == previous_time_s_;
      touches = touches || now;
      touched = touched || before;
      stays = stays || (now && before);
    }
    if (!touches || !touched) continue;
    stay = true;
    if (stays) continue;
    changed.insert(handle);
    change_again = change_again || changed_.contains(handle);
  }
  stays_in_contact_count_ += stay ? 1 : 0;
  counts_.changed_partner_count += change_again ? 1 : 0;
  changed_ = std::move(changed);
}

BlowCounts BlowGatherer::counts() const {
  BlowCounts counts = counts_;
  const auto most = kMostChanges * static_cast<double>(stays_in_contact_count_);
  if (counts.changed_partner_count < kManyChanges ||
      static_cast<double>(counts.changed_partner_count) < most) {
    counts.changed_partner_count = 0;
  }
  return counts;
}

BlowGatherer::Events BlowGatherer::Finish() {
  Events events;
  for (auto& [bodies, pair] : pairs_) {
    if (pair.blow) SendBlow(bodies, *std::exchange(pair.blow, std::nullopt), 0, events);
  }
  return events;
}

bool BlowGatherer::gathers() const {
  return std::ranges::any_of(pairs_, [](const auto& pair) { return pair.second.blow.has_value(); });
}

void BlowGatherer::Divide(const Bodies& bodies, Pair& pair, Events& events) {
  double impulse = 0;
  for (const PairTouch& touch : pair.touches) {
    impulse += Magnitude(touch.impulse.by[0].impulse().impulse_newton_seconds);
  }
  const double force = impulse / step_s_;
  // The part of the impulse that exceeds the load, 0 to 1.
  double share = pair.load.Next(impulse, step_s_);
  if (pair.blow) share = force > 0 ? std::max(1 - pair.blow->load_newtons / force, 0.0) : 0;
  double remains = 0;
  if (pair.blow && IsOver(*pair.blow, force, share * impulse, remains)) {
    SendBlow(bodies, *std::exchange(pair.blow, std::nullopt), remains, events);
    share = 0;
  } else if (share > 0) {
    if (!pair.blow) pair.blow = BlowOf(pair, (1 - share) * force);
    Gather(pair, force, share * impulse);
    if (!follows_) SendBlow(bodies, *std::exchange(pair.blow, std::nullopt), 0, events);
  }
  counts_.load_count += share > 0 ? 0 : pair.touches.size();
  for (const PairTouch& touch : pair.touches) {
    for (const Felt& felt : touch.impulse.all()) Add(felt, (1 - share) / step_s_, touch.roughness);
  }
  if (force > 0) pair.touched_s = time_s_;
  pair.touches.clear();
}

BlowGatherer::Blow BlowGatherer::BlowOf(const Pair& pair, double load_newtons) const {
  return {.load_newtons = load_newtons,
          .begin_s = *time_s_,
          .lasting = pair.touched_s && *time_s_ - *pair.touched_s <= kLastingS};
}

void BlowGatherer::Gather(Pair& pair, double force_newtons, double impulse) const {
  Blow& blow = *pair.blow;
  blow.impulses.push_back(impulse);
  blow.forces.push_back(force_newtons);
  if (impulse <= blow.greatest) return;
  blow.greatest = impulse;
  blow.touches = pair.touches;
}

bool BlowGatherer::IsOver(const Blow& blow, double force_newtons, double impulse,
                          double& remains) const {
  if (impulse <= blow.greatest / 4) return true;
  remains = force_newtons;
  if (*time_s_ - blow.begin_s >= kLongestBlowS) return true;
  const auto steps = static_cast<size_t>(std::ceil(kLoadS / step_s_));
  if (impulse > blow.greatest / 2 || blow.forces.size() < steps + 1) return false;
  return force_newtons >= 0.75 * *(blow.forces.end() - static_cast<ptrdiff_t>(steps));
}

void BlowGatherer::SendBlow(const Bodies& bodies, const Blow& blow, double remains_newtons,
                            Events& events) {
  const double excess = std::max(remains_newtons - blow.load_newtons, 0.0) * step_s_;
  double impulse = 0;
  for (const double step : blow.impulses) impulse += std::max(step - excess, 0.0);
  if (!(impulse > 0)) return;
  ++counts_.blow_count;
  double whole = 0;
  for (const PairTouch& touch : blow.touches) {
    whole += Magnitude(touch.impulse.by[0].impulse().impulse_newton_seconds);
  }
  const double scale = impulse / whole;
  for (const PairTouch& touch : blow.touches) {
    for (size_t i = 0; i < touch.impulse.count; ++i) {
      events.push_back(PartOfBlow(touch, i, scale));
      events.back().time_s = TimeOf(bodies, blow, touch);
    }
  }
}

double BlowGatherer::TimeOf(const Bodies& bodies, const Blow& blow, const PairTouch& touch) const {
  if (!blow.lasting || touch.time_offset_s > 0) return *time_s_ + touch.time_offset_s;
  return *time_s_ + Share(blow.begin_s, bodies.first, bodies.second) * step_s_;
}

/// Returns the impulse on the first or the second object of a touch, times `scale`.
ForceEvent BlowGatherer::PartOfBlow(const PairTouch& touch, size_t which, double scale) {
  const FeltContact& contact = touch.impulse;
  const double longer = contact.duration_follows_impulse ? std::pow(scale, kDurationPower) : 1;
  SurfaceImpulse part = contact.by[which].impulse();
  part.impulse_newton_seconds = Scaled(part.impulse_newton_seconds, scale);
  part.pulse = part.pulse.Lasting(static_cast<float>(part.pulse.duration_s() * longer));
  const bool of_two = contact.count == contact.by.size();
  return {.handle = contact.by[which].handle,
          .serial = contact.by[which].serial,
          .action = part,
          .by = of_two ? contact.by[1 - which].handle : touch.partner,
          .by_sounds = of_two};
}

ForceKnot BlowGatherer::MakeKnot(const std::vector<Force>& forces, double step_s) {
  double load = 0, fluctuation = 0, bandwidth = 0;
  for (const auto& [force, roughness] : forces) {
    const double share = Magnitude(force.force_newtons);
    const bool travels = roughness.travel_speed_m_per_s > 0;
    load += share;
    fluctuation += travels ? share * roughness.depth : 0;
    bandwidth +=
        share * roughness.depth * roughness.travel_speed_m_per_s / roughness.irregularity_length_m;
  }
  ForceKnot knot{.step_s = static_cast<float>(step_s)};
  if (fluctuation > 0) {
    knot.roughness = static_cast<float>(fluctuation / load);
    knot.bandwidth_hz = static_cast<float>(bandwidth / fluctuation);
  }
  return knot;
}

}  // namespace carillon
