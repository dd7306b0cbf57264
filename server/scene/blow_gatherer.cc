// SPDX-License-Identifier: Apache-2.0
#include "server/scene/blow_gatherer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/synthesis/voice/vector3.h"

namespace carillon {
namespace {

/// After the last force, one knot brings the force down to zero, and another ends the slope.
constexpr int kKnotsToEnd = 2;
constexpr double kLongestStep = StepIntervals::kLongestStep;
/// A blow lasts at most this time or, if they last longer, this number of steps.
constexpr double kLongestBlowS = 0.1;
constexpr size_t kMostBlowSteps = LoadTracker::kStepCount;
/// After this time, the force of a blow that is not over may be that of a contact that slides,
/// which is heard without waiting for the decision.
constexpr double kUndecidedS = 0.04;
/// A force that hardly changes for this time is a load.
constexpr double kLoadS = 0.01;
/// Blows that are farther apart than this are heard one by one, not as a tone.
constexpr double kLastingS = 0.1;
/// A contact that has lasted is a load without a blow if its impulses exceed the load in all by at
/// most this number of steps of the load, or by this number of standard deviations of the sum of
/// its steps: so much a solver's noise adds up to.
constexpr double kSettling = 1.5, kDeviations = 4;
/// Part of the impulses of a load that rounding may leave of it.
constexpr double kRounding = 1e-9;
/// The speed of a blow, as a part of J/m, lies between these limits, because J is (1 + e) m v with
/// a restitution e of 0 to 1. The limits leave room for engines whose masses differ a little.
constexpr double kLeastOfSpeed = 0.4, kMostOfSpeed = 2;
/// Contacts within this part of a body's extent are at one place.
constexpr double kReach = 1.0 / 8;
/// A place strikes with others in a step in which it gets at least this part of its greatest
/// impulse.
constexpr double kTogether = 0.5;
/// A contact that is lost for a shorter time than this flickers, seconds.
constexpr double kLostS = 0.01;
/// A load continues with another partner if the cosine of its change of direction is greater than
/// this, and if it does not grow more than the jitter of a load, see LoadTracker.
constexpr double kLeastCosine = 0.7, kMostGrowth = 3;
/// A longer gap than this is no stutter, seconds. Games limit their steps to about 1/3 s.
constexpr double kLongestStutterS = 0.5;
/// A client that sends this number of empty steps one after the other leaves none out.
constexpr int kEmptySteps = 3;
/// A blow grows by less than kMostGrowth from one step to the next after this number of steps.
constexpr size_t kLeastBeforeLeap = 2;

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
  events_.clear();
  const double since_s = time_s - time_s_.value_or(time_s);
  follows_ = time_s_ && since_s <= kLongestStep * nominal_step_s_;
  if (time_s_ && !follows_) {
    const double missing_count = std::round(since_s / nominal_step_s_) - 1;
    EndBeforeGap(std::min<double>(missing_count, LoadTracker::kStepCount));
  }
  if (!time_s_) first_time_s_ = time_s;
  gap_s_ = since_s;
  step_s_ = follows_ && since_s > 0 ? since_s : nominal_step_s_;
  poses_.Begin(time_s, follows_);
  previous_time_s_ = std::exchange(time_s_, time_s);
  return events_;
}

void BlowGatherer::EndBeforeGap(double missing_count) {
  int steps = 0;
  step_s_ = nominal_step_s_;
  for (Pair& pair : pairs_) pair.before_gap = pair.load;
  for (; steps < missing_count && ((steps < kKnotsToEnd && !objects_.empty()) || gathers());
       ++steps) {
    *time_s_ += step_s_;
    EndStep();
  }
  for (; steps < missing_count; ++steps) {
    for (Pair& pair : pairs_) pair.load.Next(0, step_s_);
  }
}

void BlowGatherer::Add(const BodyImpulses& force, const Roughness& roughness) {
  for (const BodyImpulse& on_body : force.all()) {
    Add(Part{.handle = on_body.handle, .serial = on_body.serial, .impulse = on_body.impulse()}, 1,
        roughness);
  }
}

void BlowGatherer::Add(const Part& part, double per_second, const Roughness& roughness) {
  forces_.push_back(
      {.handle = part.handle,
       .serial = part.serial,
       .force = {.at = part.impulse.at,
                 .force_newtons = Scaled(part.impulse.impulse_newton_seconds, per_second)},
       .roughness = roughness});
}

bool BlowGatherer::HasRoom(const ObjectTouch& touch) const {
  if (touches_.size() >= kMostTouches) return false;
  if (pairs_.size() + new_pairs_.size() < kMostTouches) return true;
  const Bodies bodies(touch.contact.handle, touch.partner);
  return new_pairs_.contains(bodies) ||
         std::ranges::binary_search(pairs_, bodies, {}, &Pair::bodies);
}

void BlowGatherer::Touch(const ObjectTouch& touch, const BodyImpulses& impulse) {
  const Bodies bodies(touch.contact.handle, touch.partner);
  if (!std::ranges::binary_search(pairs_, bodies, {}, &Pair::bodies)) new_pairs_.insert(bodies);
  PairTouch& added = touches_.emplace_back();
  added.bodies = bodies;
  added.reach_m = std::numeric_limits<double>::infinity();
  for (const BodyImpulse& on_body : impulse.all()) {
    added.parts[added.part_count++] = {.handle = on_body.handle,
                                       .mass_kg = on_body.mass_kg,
                                       .serial = on_body.serial,
                                       .impulse = on_body.impulse(),
                                       .point_m = on_body.point_m,
                                       .pressing = on_body.pressing,
                                       .turn = on_body.turn,
                                       .collision = on_body.collision};
    added.reach_m = std::min(added.reach_m, kReach * on_body.extent_m);
  }
  added.magnitude = Magnitude(added.parts[0].impulse.impulse_newton_seconds);
  added.pressing = std::sqrt(Dot(added.parts[0].pressing, added.parts[0].pressing));
  added.roughness = touch.roughness;
  added.time_offset_s = touch.time_offset_s;
  added.duration_follows_impulse = impulse.duration_follows_impulse;
  added.mass_is_stated = impulse.mass_is_stated;
  added.striker_per_kg = impulse.striker_per_kg;
}

BlowGatherer::Events BlowGatherer::End() {
  events_.clear();
  if (empty_step_count_ < kEmptySteps) {
    empty_step_count_ = touches_.empty() && follows_ ? empty_step_count_ + 1 : 0;
  }
  EndStep();
  return events_;
}

void BlowGatherer::EndStep() {
  PairTouches();
  FollowPartners();
  motions_.clear();
  const bool stutters = Stutters();
  for (Pair& pair : pairs_) {
    if (stutters && ContinuesAfterGap(pair)) continue;
    Divide(pair);
  }
  std::erase_if(pairs_, [](const Pair& pair) { return pair.load.idle() && !pair.blow.begun(); });
  touches_.clear();
  SendForces();
}

void BlowGatherer::PairTouches() {
  // A client usually reports its contacts in the same order in each step.
  if (!std::ranges::is_sorted(touches_, {}, &PairTouch::bodies)) {
    std::ranges::stable_sort(touches_, {}, &PairTouch::bodies);
  }
  if (!new_pairs_.empty()) {
    const auto known_count = static_cast<ptrdiff_t>(pairs_.size());
    for (const Bodies& bodies : new_pairs_) pairs_.push_back({.bodies = bodies});
    std::ranges::inplace_merge(pairs_, pairs_.begin() + known_count, {}, &Pair::bodies);
    new_pairs_.clear();
  }
  auto first = touches_.begin();
  for (Pair& pair : pairs_) {
    const auto last = std::find_if(first, touches_.end(), [&pair](const PairTouch& touch) {
      return touch.bodies != pair.bodies;
    });
    pair.touches = {first, last};
    first = last;
  }
}

void BlowGatherer::SendForces() {
  std::ranges::stable_sort(forces_, {}, &Force::handle);
  const auto known_count = static_cast<ptrdiff_t>(objects_.size());
  for (size_t i = 0; i < forces_.size(); ++i) {
    const uint32_t handle = forces_[i].handle;
    const auto known = std::span(objects_).first(static_cast<size_t>(known_count));
    if (i > 0 && forces_[i - 1].handle == handle) continue;
    if (std::ranges::binary_search(known, handle, {}, &Object::handle)) continue;
    objects_.push_back({.handle = handle});
  }
  std::ranges::inplace_merge(objects_, objects_.begin() + known_count, {}, &Object::handle);
  auto first = forces_.begin();
  for (Object& object : objects_) {
    const auto last = std::find_if(first, forces_.end(), [&object](const Force& force) {
      return force.handle != object.handle;
    });
    const std::span<const Force> forces(first, last);
    first = last;
    // Another object may have got the handle of one that was removed.
    if (!forces.empty()) object.serial = forces.back().serial;
    for (const Force& force : forces) {
      events_.push_back({object.handle, force.serial, force.force, *time_s_});
    }
    events_.push_back({object.handle, object.serial, MakeKnot(forces, step_s_), *time_s_});
    object.steps_without = forces.empty() ? object.steps_without + 1 : 0;
  }
  std::erase_if(objects_, [](const Object& object) { return object.steps_without >= kKnotsToEnd; });
  forces_.clear();
}

void BlowGatherer::FollowPartners() {
  std::vector<std::pair<uint32_t, Pair*>> ceased;
  bool begins = false;
  for (Pair& pair : pairs_) {
    begins = begins || (!pair.touches.empty() && !pair.touched_s);
    if (!pair.touches.empty() || !pair.touched_s || pair.touched_s != previous_time_s_) continue;
    for (const Motion& given : pair.given) {
      if (given.mass_kg > 0) ceased.emplace_back(given.handle, &pair);
    }
  }
  if (!begins || ceased.empty()) return;
  std::ranges::sort(ceased);
  for (Pair& pair : pairs_) {
    if (pair.touches.empty() || pair.touched_s) continue;
    for (const Part& part : pair.touches.front().all()) {
      auto found =
          std::ranges::lower_bound(ceased, part.handle, {}, &std::pair<uint32_t, Pair*>::first);
      const auto is_same = [&] { return found != ceased.end() && found->first == part.handle; };
      while (is_same() && !Continues(*found->second, pair)) ++found;
      if (!is_same()) continue;
      pair.load = std::exchange(found->second->load, {});
      pair.blow = std::exchange(found->second->blow, {});
      pair.touched_s = std::exchange(found->second->touched_s, std::nullopt);
      break;
    }
  }
}

bool BlowGatherer::Continues(const Pair& before, const Pair& now) {
  if (!before.touched_s) return false;  // another pair continues it
  for (const Motion& is : GivenBy(now.touches)) {
    for (const Motion& was : before.given) {
      if (is.mass_kg == 0 || was.mass_kg == 0 || is.handle != was.handle) continue;
      const double grown = std::sqrt(Dot(is.impulse, is.impulse) / Dot(was.impulse, was.impulse));
      const double along = Dot(is.impulse, was.impulse) / Dot(was.impulse, was.impulse);
      return grown <= kMostGrowth && along >= kLeastCosine * grown;
    }
  }
  return false;
}

std::array<BlowGatherer::Motion, 2> BlowGatherer::GivenBy(std::span<const PairTouch> touches) {
  std::array<Motion, 2> given{};
  for (const PairTouch& touch : touches) {
    for (size_t i = 0; i < touch.part_count; ++i) {
      given[i].handle = touch.parts[i].handle;
      given[i].mass_kg = touch.parts[i].mass_kg;
      for (size_t axis = 0; axis < 3; ++axis) {
        given[i].impulse[axis] += touch.parts[i].impulse.impulse_newton_seconds[axis];
      }
    }
  }
  return given;
}

void BlowGatherer::AddUpMotions() {
  for (const PairTouch& touch : touches_) {
    for (const Motion& given : GivenBy(std::span(&touch, 1))) {
      if (given.mass_kg > 0) motions_.push_back(given);
    }
  }
  std::ranges::sort(motions_, {}, &Motion::handle);
  size_t count = 0;
  for (const Motion& motion : motions_) {
    if (count == 0 || motions_[count - 1].handle != motion.handle) {
      motions_[count++] = motion;
      continue;
    }
    for (size_t axis = 0; axis < 3; ++axis) {
      motions_[count - 1].impulse[axis] += motion.impulse[axis];
    }
  }
  motions_.resize(count);
}

bool BlowGatherer::IsFeeble(const Pair& pair) {
  if (motions_.empty()) AddUpMotions();
  return std::ranges::all_of(GivenBy(pair.touches), [this](const Motion& given) {
    if (given.mass_kg == 0) return true;
    const Motion& sum = *std::ranges::lower_bound(motions_, given.handle, {}, &Motion::handle);
    const double most = kMostGravityMPerS2 * step_s_ * given.mass_kg;
    return Dot(sum.impulse, sum.impulse) <= most * most;
  });
}

bool BlowGatherer::MayFlicker(const Pair& pair) const {
  const double since_s = *time_s_ - std::max(first_time_s_, pair.touched_s.value_or(first_time_s_));
  return since_s <= (MostLostSteps() + 1.5) * nominal_step_s_;
}

int BlowGatherer::MostLostSteps() const {
  constexpr double kFewest = 1, kMost = 4;
  return static_cast<int>(std::clamp(std::ceil(kLostS / step_s_), kFewest, kMost));
}

bool BlowGatherer::MayFollow() const {
  return !previous_time_s_ || gap_s_ <= (MostLostSteps() + 0.5) * nominal_step_s_;
}

BlowGatherer::Events BlowGatherer::Finish() {
  events_.clear();
  for (Pair& pair : pairs_) {
    Blow& blow = pair.blow;
    if (!blow.begun()) continue;
    if (blow.feeble && blow.lasting) {
      CountAsLoad(blow);
      continue;
    }
    const bool rests = blow.feeble && blow.steps.size() > 1 && blow.lost_steps == 0;
    SendBlow(pair, rests ? blow.steps.back().force : 0);
  }
  return events_;
}

bool BlowGatherer::gathers() const {
  return std::ranges::any_of(pairs_, [](const Pair& pair) { return pair.blow.begun(); });
}

bool BlowGatherer::Stutters() const {
  if (follows_ || gap_s_ > kLongestStutterS) return false;
  if (empty_step_count_ == kEmptySteps) return true;
  size_t rested_count = 0, rests_count = 0;
  for (const Pair& pair : pairs_) {
    if (!pair.before_gap.rests()) continue;
    ++rested_count;
    rests_count += pair.touches.empty() ? 0 : 1;
  }
  return rests_count >= 2 && rests_count >= rested_count * 3 / 4;
}

bool BlowGatherer::ContinuesAfterGap(Pair& pair) {
  if (pair.touches.empty() || pair.blow.begun() || !pair.before_gap.rests()) return false;
  const double impulse = ImpulseOf(pair);
  LoadTracker load = pair.before_gap;
  if (load.Next(impulse, gap_s_) > 0 || impulse < gap_s_ * load.Usual() / kMostGrowth) return false;
  pair.load = load;
  counts_.load_count += pair.touches.size();
  EndTouches(pair, 1 / gap_s_);
  return true;
}

double BlowGatherer::ImpulseOf(const Pair& pair) {
  double impulse = 0;
  for (const PairTouch& touch : pair.touches) impulse += touch.magnitude;
  return impulse;
}

void BlowGatherer::Divide(Pair& pair) {
  const double impulse = ImpulseOf(pair);
  const double force = impulse / step_s_;
  const bool elsewhere = pair.load.has_blows() && StrikesElsewhere(pair);
  if (elsewhere) pair.load.ForgetBlows();
  // The part of the impulse that exceeds the load, 0 to 1.
  const double share_of_new_blow = pair.load.Next(impulse, step_s_);
  EndBeforeLeap(pair, force);
  double share = share_of_new_blow;
  if (pair.blow.begun()) {
    share = force > 0 ? std::max(1 - pair.blow.load_newtons / force, 0.0) : 0;
  }
  const bool undecided = pair.blow.begun() && *time_s_ - pair.blow.begin_s() >= kUndecidedS;
  double remains = 0;
  Blow& blow = pair.blow;
  if (Flickers(blow, force)) share = IsFeeble(pair) ? 0 : share_of_new_blow;
  if (blow.begun() && IsOver(blow, force, share * force, elsewhere, remains)) {
    if ((HasLasted(blow) || blow.only_feeble) &&
        ImpulseAbove(blow, remains) <= Settling(blow) * remains * MeanStepS(blow)) {
      CountAsLoad(blow);
    } else {
      SendBlow(pair, remains);
      pair.flew_until_s = blow.load_newtons == 0 && remains == 0 ? time_s_ : std::nullopt;
    }
    share = 0;
  } else if (share > 0) {
    if (!blow.begun()) {
      blow.load_newtons = (1 - share) * force;
      blow.feeble = MayFlicker(pair) && IsFeeble(pair);
      blow.lost_steps = 0;
    }
    Gather(pair, force, share * force);
    if (!follows_ && !(blow.feeble && MayFollow())) SendBlow(pair, 0);
  }
  // Bodies that met in flight and part again bore no load. A soft contact may push for one more
  // step after its blow is over.
  if (force == 0 && pair.flew_until_s && *time_s_ <= *pair.flew_until_s + kLongestStep * step_s_) {
    pair.load.Forget();
  }
  counts_.load_count += share > 0 ? 0 : pair.touches.size();
  if (undecided) share = 0;
  EndTouches(pair, (1 - share) / step_s_);
}

void BlowGatherer::EndTouches(Pair& pair, double per_second) {
  for (const PairTouch& touch : pair.touches) {
    for (const Part& part : touch.all()) Add(part, per_second, touch.roughness);
  }
  if (!pair.touches.empty()) {
    pair.touched_s = time_s_;
    pair.given = GivenBy(pair.touches);
  }
  pair.touches = {};
}

void BlowGatherer::EndBeforeLeap(Pair& pair, double force_newtons) {
  Blow& blow = pair.blow;
  if (blow.steps.size() < kLeastBeforeLeap || blow.lost_steps > 0) return;
  const double greatest = std::ranges::max(blow.steps, {}, &Blow::Step::force).force;
  if (force_newtons <= kMostGrowth * greatest) return;
  if (blow.only_feeble) {
    CountAsLoad(blow);
  } else {
    SendBlow(pair, 0);
  }
}

void BlowGatherer::CountAsLoad(Blow& blow) {
  for (const Place& place : blow.places) {
    counts_.load_count += blow.steps.size() * place.touches.size();
  }
  blow.steps.clear();
}

bool BlowGatherer::Flickers(Blow& blow, double force_newtons) {
  if (!blow.begun() || !blow.feeble) return false;
  const bool returns = force_newtons > 0 && blow.lost_steps > 0;
  if (returns) CountAsLoad(blow);
  blow.lost_steps = force_newtons > 0 ? 0 : blow.lost_steps + 1;
  return returns;
}

double BlowGatherer::ApproachSpeed(std::span<const PairTouch> touches) const {
  double sum = 0, weights = 0;
  for (const PairTouch& touch : touches) {
    std::array<RecentPoses::Ray, 2> rays{};
    for (size_t i = 0; i < touch.part_count; ++i) {
      const Part& part = touch.parts[i];
      rays[i] = {.handle = part.handle, .point_m = part.point_m, .direction = part.pressing};
      for (double& component : rays[i].direction) component /= touch.pressing;
    }
    const std::optional<double> speed =
        poses_.ApproachSpeed(std::span(rays).first(touch.part_count));
    if (!speed) return 0;
    sum += touch.magnitude * *speed;
    weights += touch.magnitude;
  }
  return weights > 0 ? std::max(sum / weights, 0.0) : 0;
}

void BlowGatherer::Gather(Pair& pair, double force_newtons, double above_newtons) {
  Blow& blow = pair.blow;
  if (!blow.begun()) {
    const auto lately = [this](const std::optional<double>& time_s) {
      return time_s && *time_s_ - *time_s <= kLastingS;
    };
    blow.lasting =
        lately(pair.touched_s) && (lately(pair.blow_before_last_s) || !StrikesElsewhere(pair));
    pair.blow_before_last_s = std::exchange(pair.last_blow_s, time_s_);
    blow.greatest_newtons = 0;
    blow.only_feeble = true;
    blow.places.clear();
  }
  blow.steps.push_back({.impulse = above_newtons * step_s_,
                        .force = force_newtons,
                        .time_s = *time_s_,
                        .step_s = step_s_});
  blow.greatest_newtons = std::max(blow.greatest_newtons, above_newtons);
  blow.only_feeble = blow.only_feeble && IsFeeble(pair);
  blow.feeble = blow.feeble && blow.only_feeble;
  AddToPlaces(blow, pair.touches, above_newtons / force_newtons);
}

void BlowGatherer::AddToPlaces(Blow& blow, std::span<const PairTouch> touches, double share) const {
  const size_t step = blow.steps.size() - 1;
  const size_t known_count = blow.places.size();
  std::vector<std::vector<PairTouch>> by_place(known_count);
  for (const PairTouch& touch : touches) {
    const auto found = std::ranges::find_if(
        blow.places, [&touch](const Place& place) { return IsAtOnePlace(place.latest, touch); });
    const auto at = static_cast<size_t>(found - blow.places.begin());
    if (found == blow.places.end()) {
      blow.places.push_back({.latest = touch});
      by_place.emplace_back();
    }
    blow.places[at].impulses.resize(step + 1);
    blow.places[at].impulses[step] += share * touch.magnitude;
    by_place[at].push_back(touch);
  }
  std::vector<PairTouch> begin;
  for (size_t at = 0; at < by_place.size(); ++at) {
    Place& place = blow.places[at];
    if (by_place[at].empty()) continue;
    if (at >= known_count) std::ranges::copy(by_place[at], std::back_inserter(begin));
    place.latest = by_place[at].front();
    if (!place.touches.empty() && place.impulses[step] <= place.greatest()) continue;
    place.strongest = step;
    place.touches = std::move(by_place[at]);
  }
  if (begin.empty()) return;
  const double approach_m_per_s = ApproachSpeed(begin);
  for (Place& place : std::span(blow.places).subspan(known_count)) {
    place.approach_m_per_s = approach_m_per_s;
  }
}

bool BlowGatherer::IsAtOnePlace(const PairTouch& one, const PairTouch& other) {
  for (const Part& part : one.all()) {
    for (const Part& same : other.all()) {
      if (part.handle != same.handle) continue;
      const Vector3 apart{part.point_m[0] - same.point_m[0], part.point_m[1] - same.point_m[1],
                          part.point_m[2] - same.point_m[2]};
      const double reach_m = std::min(one.reach_m, other.reach_m);
      if (Dot(apart, apart) <= reach_m * reach_m) return true;
    }
  }
  return false;
}

bool BlowGatherer::StrikesElsewhere(const Pair& pair) {
  if (pair.blow.places.empty() || IsFeeble(pair)) return false;
  double known = 0, all = 0;
  for (const PairTouch& touch : pair.touches) {
    all += touch.magnitude;
    const auto is_near = [&touch](const Place& place) { return IsAtOnePlace(place.latest, touch); };
    if (std::ranges::any_of(pair.blow.places, is_near)) known += touch.magnitude;
  }
  return known < all / 2;
}

bool BlowGatherer::IsOver(const Blow& blow, double force_newtons, double above_newtons,
                          bool elsewhere, double& remains) const {
  if (blow.lost_steps > 0) return blow.lost_steps > MostLostSteps();
  if (above_newtons <= blow.greatest_newtons / 4) return !elsewhere;
  if (HasLasted(blow)) {
    remains = MeanForceOfLastHalf(blow);
    return true;
  }
  remains = 0;
  const auto steps = static_cast<size_t>(std::ceil(kLoadS / step_s_));
  if (above_newtons > blow.greatest_newtons / 2 || blow.steps.size() < steps + 1) return false;
  const auto last = std::span(blow.steps).last(steps);
  for (const Blow::Step& step : last) remains += step.force / static_cast<double>(steps);
  return force_newtons >= 0.75 * last.front().force;
}

bool BlowGatherer::HasLasted(const Blow& blow) const {
  return *time_s_ - blow.begin_s() >= kLongestBlowS && blow.steps.size() >= kMostBlowSteps;
}

double BlowGatherer::MeanForceOfLastHalf(const Blow& blow) {
  const auto last = std::span(blow.steps).last(blow.steps.size() / 2);
  double sum = 0;
  for (const Blow::Step& step : last) sum += step.force;
  return sum / static_cast<double>(last.size());
}

double BlowGatherer::Settling(const Blow& blow) {
  const auto last = std::span(blow.steps).last(blow.steps.size() / 2);
  const double mean = MeanForceOfLastHalf(blow);
  double squares = 0;
  for (const Blow::Step& step : last) squares += (step.force - mean) * (step.force - mean);
  const double deviation = std::sqrt(squares / static_cast<double>(last.size())) / mean;
  return std::max(kSettling,
                  kDeviations * deviation * std::sqrt(static_cast<double>(blow.steps.size())));
}

double BlowGatherer::MeanStepS(const Blow& blow) {
  double sum_s = 0;
  for (const Blow::Step& step : blow.steps) sum_s += step.step_s;
  return sum_s / static_cast<double>(blow.steps.size());
}

double BlowGatherer::ImpulseAbove(const Blow& blow, double load_newtons) {
  const double excess = std::max(load_newtons - blow.load_newtons, 0.0);
  double impulse = 0;
  for (const Blow::Step& step : blow.steps) impulse += step.impulse - excess * step.step_s;
  return impulse;
}

void BlowGatherer::SendBlow(Pair& pair, double remains_newtons) {
  Blow& blow = pair.blow;
  const double above_load = ImpulseAbove(blow, 0);
  const double share = ImpulseAbove(blow, remains_newtons) / above_load;
  if (!(share > kRounding)) return CountAsLoad(blow);
  ++counts_.blow_count;
  const std::vector<Impact> impacts = ImpactsOf(blow, share);
  const double first_s = blow.steps[impacts.front().step].time_s;
  for (const Impact& impact : impacts) {
    SendImpact(pair, impact, blow.steps[impact.step].time_s - first_s);
  }
  blow.steps.clear();
}

std::vector<BlowGatherer::Impact> BlowGatherer::ImpactsOf(const Blow& blow, double share) {
  std::vector<const Place*> left;
  for (const Place& place : blow.places) left.push_back(&place);
  std::vector<Impact> impacts;
  while (!left.empty()) {
    const Place& strongest = **std::ranges::max_element(left, {}, &Place::greatest);
    Impact impact{.step = strongest.strongest};
    std::erase_if(left, [&](const Place* place) {
      if (place->impulse_in(impact.step) < kTogether * place->greatest()) return false;
      if (impact.strikes.empty()) impact.approach_m_per_s = place->approach_m_per_s;
      double of_place = 0, of_touches = 0;
      for (const double of_step : place->impulses) of_place += share * of_step;
      for (const PairTouch& touch : place->touches) of_touches += touch.magnitude;
      for (const PairTouch& touch : place->touches) {
        impact.strikes.push_back({.touch = &touch, .scale = of_place / of_touches});
      }
      return true;
    });
    impacts.push_back(std::move(impact));
  }
  std::ranges::sort(impacts, {}, &Impact::step);
  return impacts;
}

void BlowGatherer::SendImpact(const Pair& pair, const Impact& impact, double later_s) {
  std::map<uint32_t, double> by_vertex;
  double whole = 0, squares = 0;
  for (const Strike& strike : impact.strikes) {
    by_vertex[VertexOf(*strike.touch)] += strike.impulse();
    whole += strike.impulse();
  }
  for (const auto& [vertex, impulse] : by_vertex) squares += impulse * impulse;
  const Collision collision = CollisionOf(impact);
  for (const Strike& strike : impact.strikes) {
    const BlowShares shares{.scale = strike.scale,
                            .of_blow = strike.impulse() / whole,
                            .of_mass = squares / (whole * whole),
                            .mass_kg = collision.reduced_mass_kg,
                            .speed_m_per_s = collision.stated_speed_m_per_s};
    for (size_t i = 0; i < strike.touch->part_count; ++i) {
      events_.push_back(PartOfBlow(*strike.touch, i, shares));
      events_.back().time_s = TimeOf(pair.bodies, pair.blow, *strike.touch) + later_s;
    }
  }
}

Collision BlowGatherer::CollisionOf(const Impact& impact) {
  const PairTouch& first = *impact.strikes.front().touch;
  double masses = 0, impulse = 0;
  for (const auto& [touch, scale] : impact.strikes) {
    impulse += scale * touch->pressing;
    masses += scale * touch->pressing * touch->parts[0].collision.reduced_mass_kg;
  }
  double per_kg = first.striker_per_kg.value_or(0);
  for (size_t i = 0; i < first.part_count; ++i) {
    Vector3 push{}, turn{};
    for (const auto& [touch, scale] : impact.strikes) {
      for (size_t axis = 0; axis < push.size(); ++axis) {
        push[axis] += scale * touch->parts[i].pressing[axis];
        turn[axis] += scale * touch->parts[i].turn[axis];
      }
    }
    const double mass = first.parts[i].mass_kg;
    const double moved_per_kg = (Dot(push, push) / mass + Dot(turn, turn)) / (impulse * impulse);
    per_kg += std::max(moved_per_kg, 1 / mass);  // impulses that cancel move nothing
  }
  const double speed = impact.approach_m_per_s;
  if (speed >= kLeastOfSpeed * impulse * per_kg && speed <= kMostOfSpeed * impulse * per_kg) {
    return {.reduced_mass_kg = 1 / per_kg, .stated_speed_m_per_s = speed};
  }
  return {.reduced_mass_kg = first.striker_per_kg ? 1 / per_kg : masses / impulse};
}

uint32_t BlowGatherer::VertexOf(const PairTouch& touch) {
  const SurfaceImpulse& impulse = touch.parts[0].impulse;
  const auto nearest = std::ranges::max_element(impulse.at.weights) - impulse.at.weights.begin();
  return impulse.at.vertices[static_cast<size_t>(nearest)];
}

double BlowGatherer::TimeOf(const Bodies& bodies, const Blow& blow, const PairTouch& touch) const {
  if (!blow.lasting || touch.time_offset_s > 0) return *time_s_ + touch.time_offset_s;
  return *time_s_ + Share(blow.begin_s(), bodies.first, bodies.second) * step_s_;
}

/// Returns the impulse on the first or the second object of a touch.
ForceEvent BlowGatherer::PartOfBlow(const PairTouch& touch, size_t which,
                                    const BlowShares& shares) {
  const Part& part = touch.parts[which];
  Collision collision = part.collision;
  double longer = 1;
  if (collision.reduced_mass_kg > 0 && std::isfinite(collision.reduced_mass_kg)) {
    const double mass = touch.mass_is_stated ? collision.reduced_mass_kg : shares.mass_kg;
    longer *= std::pow(mass / collision.reduced_mass_kg * shares.of_mass, kMassPower);
    if (touch.duration_follows_impulse) {
      // The duration was computed for the speed of the touch alone.
      const double alone = touch.pressing / (2 * collision.reduced_mass_kg);
      const double elastic = shares.scale * touch.pressing / shares.of_blow / (2 * mass);
      const double speed = shares.speed_m_per_s > 0 ? shares.speed_m_per_s : elastic;
      longer *= std::pow(speed / alone, kDurationPower);
      collision.stated_speed_m_per_s = shares.speed_m_per_s;
    }
    collision.reduced_mass_kg = mass * shares.of_blow;
  } else if (touch.duration_follows_impulse) {
    longer *= std::pow(shares.scale / shares.of_blow, kDurationPower);
  }
  SurfaceImpulse impulse = part.impulse;
  impulse.impulse_newton_seconds = Scaled(impulse.impulse_newton_seconds, shares.scale);
  impulse.pulse = impulse.pulse.Lasting(
      static_cast<float>(std::min(impulse.pulse.duration_s() * longer, kLongestContactS)));
  const bool of_two = touch.part_count == touch.parts.size();
  return {.handle = part.handle,
          .serial = part.serial,
          .action = impulse,
          .collision = collision,
          .by = of_two ? touch.parts[1 - which].handle : touch.bodies.second,
          .by_sounds = of_two};
}

ForceKnot BlowGatherer::MakeKnot(std::span<const Force> forces, double step_s) {
  double load = 0, fluctuation = 0, bandwidth = 0;
  for (const Force& force : forces) {
    const Roughness& roughness = force.roughness;
    const double share = Magnitude(force.force.force_newtons);
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
