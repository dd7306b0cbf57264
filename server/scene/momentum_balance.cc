// SPDX-License-Identifier: Apache-2.0
#include "server/scene/momentum_balance.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <ranges>
#include <span>
#include <tuple>
#include <utility>

#include "server/synthesis/voice/vector3.h"

namespace carillon {
namespace {

constexpr double kEarthMPerS2 = 9.81;
/// A speed that changes in a step by more than gravity changes it in this many steps leaps.
constexpr double kLeapSteps = 6;
/// Within a leap, and between a leap and a calm time.
constexpr double kCalmSteps = 2;
/// A leap with more steps is no blow.
constexpr int kMostLeapSteps = 8;
/// The calm steps that must follow a leap. They have the impulses that come late.
constexpr int kStepsAfter = 3;
/// Part of a leap that may remain unexplained, because shapes, masses and damping differ a little.
constexpr double kUnexplained = 0.25;
/// Part of a leap that is as good as no impulse.
constexpr double kNothing = 0.1;
/// Part by which a ratio may differ from that of a mistake.
constexpr double kRatioError = 0.1, kRestRatioError = 0.04;
constexpr double kSameDirection = 0.9;
constexpr uint64_t kFewestBlows = 3, kFewestRestSteps = 30;
/// Part of the blows, or of the contacts, that must show a mistake.
constexpr double kMost = 0.6, kMostEqual = 0.8;
constexpr size_t kMostFlights = 64, kMostRatios = 32;
constexpr double kForceError = 0.25;
/// The growth of a load in a step, as in LoadTracker.
constexpr double kMostLoadGrowth = 3;
/// The numbers of substeps that engines make of a step.
constexpr std::array<int, 7> kSubsteps{2, 3, 4, 5, 8, 10, 16};
/// Equal impulses in this number of steps, on a body that they do not move, are stale.
constexpr int kStaleSteps = 4;
/// The speed at which a body leaves its partner for certain, m/s.
constexpr double kLeastSpeed = 0.05;
/// Bodies that are remembered though they neither move nor touch.
constexpr size_t kMostIdleBodies = 4096;

Vector3 Sum(const Vector3& a, const Vector3& b, double scale = 1) {
  return {a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]};
}

bool IsNear(double ratio, double expected, double error) {
  return std::abs(ratio / expected - 1) <= error;
}

/// Sorts `values`, and returns their median.
double Median(std::vector<double>& values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// Returns whether a ratio is that of the last of some substeps.
bool IsPartOfSubsteps(double ratio, double error) {
  return std::ranges::any_of(kSubsteps, [&](int count) { return IsNear(ratio * count, 1, error); });
}

bool IsEqual(const MomentumBalance::Report& a, const MomentumBalance::Report& b) {
  if (a.handle != b.handle || a.vertices != b.vertices) return false;
  double difference = 0, whole = 0;
  for (size_t i = 0; i < 3; ++i) {
    if (std::abs(a.weights[i] - b.weights[i]) > 1e-4F) return false;
    difference += std::abs(a.impulse_newton_seconds[i] - b.impulse_newton_seconds[i]);
    whole += std::abs(a.impulse_newton_seconds[i]);
  }
  return difference <= 1e-5 * whole;
}

}  // namespace

MomentumBalance::Body& MomentumBalance::BodyOfStep(uint32_t handle) {
  Body& body = bodies_[handle];
  if (!std::exchange(body.is_of_step, true)) of_step_.emplace_back(handle, &body);
  return body;
}

void MomentumBalance::Move(uint32_t handle, const Vector3& centre_m,
                           const Quaternion& orientation) {
  Body& body = BodyOfStep(handle);
  body.moves_now = true;
  body.orientation = orientation;
  // The velocity is that of the last step until EndStep knows the time.
  if (body.centre_m) body.velocity = Sum(centre_m, *body.centre_m, -1);
  body.centre_m = centre_m;
}

void MomentumBalance::EndStep(double time_s) {
  CountEqual();
  for (const Report& report : reports_) BodyOfStep(report.handle);
  for (const uint32_t handle : empty_touches_) {
    if (bodies_.contains(handle)) BodyOfStep(handle);
  }
  std::ranges::sort(of_step_);
  for (const auto& [handle, body] : of_step_) AddStep(*body, time_s);
  for (const Report& report : reports_) {
    Body& body = bodies_[report.handle];
    Step& step = body.steps.back();
    Vector3 reported{};
    for (size_t i = 0; i < 3; ++i) reported[i] = report.impulse_newton_seconds[i] / report.mass_kg;
    step.touches = true;
    step.reported = Sum(step.reported, Rotated(reported, body.orientation));
    step.reported_otherwise = Sum(
        step.reported_otherwise,
        scene_frame_ ? Rotated(Rotated(reported, body.orientation), body.orientation) : reported);
  }
  for (const uint32_t handle : empty_touches_) {
    const auto found = bodies_.find(handle);
    if (found != bodies_.end()) found->second.steps.back().touches = true;
  }
  for (const auto& [handle, body] : of_step_) EndStep(*body, handle);
  ++step_count_;
  if (bodies_.size() > kMostIdleBodies) {
    std::erase_if(bodies_, [this](const auto& entry) {
      return entry.second.step_count + 2 * kStepCount < step_count_;
    });
  }
  of_step_.clear();
  reports_.clear();
  empty_touches_.clear();
  time_s_ = time_s;
}

void MomentumBalance::AddStep(Body& body, double time_s) {
  // The steps in which the body neither moved nor touched are empty.
  if (!body.steps.empty() && body.step_count < step_count_) {
    body.pose_count = 0;
    body.steps.resize(body.steps.size() + std::min(step_count_ - body.step_count, kStepCount));
  }
  body.step_count = step_count_ + 1;
  Step step;
  const double since_s = time_s - time_s_.value_or(time_s - step_s_);
  const bool follows = since_s > 0 && since_s < 1.5 * step_s_;
  step.step_s = since_s > 0 ? std::min(since_s, step_s_) : step_s_;
  body.pose_count = body.moves_now && follows ? body.pose_count + 1 : (body.moves_now ? 1 : 0);
  const Vector3 before = body.steps.empty() ? Vector3{} : body.steps.back().velocity;
  if (body.pose_count >= 2) step.velocity = Sum({}, body.velocity, 1 / since_s);
  step.moved = body.pose_count >= 3;
  if (step.moved) step.leap = Sum(step.velocity, before, -1);
  if (body.steps.size() >= 2 * kStepCount) {
    body.steps.erase(body.steps.begin(), body.steps.end() - kStepCount);
  }
  body.steps.push_back(step);
}

void MomentumBalance::EndStep(Body& body, uint32_t handle) {
  Step& now = body.steps.back();
  body.moves_now = body.is_of_step = false;
  if (body.steps.size() > 1) {
    const Step& before = body.steps[body.steps.size() - 2];
    const double size = Length(now.reported);
    now.repeats = size > 0 && (now.reported_otherwise == before.reported_otherwise ||
                               Length(Sum(now.reported, before.reported, -1)) < 1e-6 * size);
  }
  NoteRest(body);
  if (!now.moved) return;
  NoteFlight(body);
  NoteStale(body);
  NoteLeap(body, handle);
}

/// A body without contacts in five steps, of which the third is taken, shows gravity.
void MomentumBalance::NoteFlight(Body& body) {
  constexpr size_t kSteps = 5;
  if (body.steps.size() < kSteps) return;
  const auto last = std::span(body.steps).last(kSteps);
  const bool flies =
      std::ranges::all_of(last, [](const Step& step) { return step.moved && !step.touches; });
  const Step& middle = last[kSteps / 2];
  const Vector3 acceleration = Sum({}, middle.leap, 1 / middle.step_s);
  if (!flies || Length(acceleration) < 0.05 * kEarthMPerS2) return;
  if (!has_gravity_ || Length(Sum(acceleration, gravity_, -1)) < kNothing * Length(gravity_)) {
    body.flew = true;
  }
  if (flights_.size() == kMostFlights) return;
  flights_.push_back(acceleration);
  for (size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3& flight : flights_) values.push_back(flight[axis]);
    gravity_[axis] = Median(values);
  }
  // A body that a motor moves, as a link of a robot, accelerates otherwise each time.
  const auto alike = std::ranges::count_if(flights_, [this](const Vector3& flight) {
    return Length(Sum(flight, gravity_, -1)) < kNothing * Length(gravity_);
  });
  has_gravity_ = flights_.size() >= 3 &&
                 static_cast<double>(alike) >= kMost * static_cast<double>(flights_.size());
}

double MomentumBalance::Gravity() const { return has_gravity_ ? Length(gravity_) : kEarthMPerS2; }

/// A load that does not move a body, or one of a body without poses, is as great as its weight.
void MomentumBalance::NoteRest(Body& body) {
  constexpr size_t kSteps = 3;
  if (body.steps.size() < kSteps) return;
  for (const Step& step : std::span(body.steps).last(kSteps)) {
    const bool still =
        step.moved ? Length(step.leap) <= 0.2 * Gravity() * step.step_s : !body.centre_m;
    if (!still || Length(step.reported) == 0) return;
  }
  // A blow on a body whose motion is not known is no load.
  const Step& before = body.steps[body.steps.size() - 2];
  if (Length(body.steps.back().reported) > kMostLoadGrowth * Length(before.reported)) return;
  ++body.rest_count;
  body.rest_s += body.steps.back().step_s;
  body.rest_reported = Sum(body.rest_reported, body.steps.back().reported);
}

/// The same impulse again and again, that does not move the body: a load on a body that falls, or
/// that was thrown from its partner without an impulse.
void MomentumBalance::NoteStale(Body& body) {
  const Step& now = body.steps.back();
  if (!now.repeats) {
    body.stale_run = 0;
    body.thrown = false;
    return;
  }
  const double reported = Length(now.reported);
  const double leap = Length(now.leap);
  const double weight = Gravity() * now.step_s;
  const double away = Dot(now.velocity, now.reported) / reported;
  const bool throws = Dot(now.leap, now.reported) > kSameDirection * leap * reported;
  if (leap > kLeapSteps * weight && reported < kNothing * leap && throws) body.thrown = true;
  const bool falls = IsNear(reported, weight, kUnexplained) && Dot(now.leap, now.reported) < 0 &&
                     Length(Sum(now.leap, now.reported)) <= kUnexplained * reported;
  const bool ignored =
      body.flew && reported > kLeapSteps * weight && leap < kUnexplained * reported;
  if (falls || (away > kLeastSpeed && (body.thrown || ignored))) ++body.stale_run;
  if (body.stale_run == kStaleSteps) body.stale_count += kStaleSteps - 1;
  if (body.stale_run >= kStaleSteps) ++body.stale_count;
}

void MomentumBalance::NoteLeap(Body& body, uint32_t handle) {
  const Step& now = body.steps.back();
  const Vector3 free = Sum(now.leap, gravity_, -now.step_s);
  const double weight = Gravity() * now.step_s;
  // Without gravity, a body at rest has no leap, and one that falls has a small one.
  const bool calm = std::min(Length(free), Length(now.leap)) <= kCalmSteps * weight;
  if (!calm) {
    body.leap_steps += 1 + body.calm_steps;
    body.calm_steps = 0;
    return;
  }
  if (body.leap_steps == 0 || ++body.calm_steps < kStepsAfter) return;
  const auto size = body.steps.size();
  const auto length = static_cast<size_t>(body.leap_steps);
  body.leap_steps = 0;
  body.calm_steps = 0;
  // Two steps lie before the leap, so that those of an impulse that comes early are known.
  if (length > kMostLeapSteps || size < length + kStepsAfter + 2) return;
  const size_t first = size - kStepsAfter - length;
  Judge(body, handle, first, first + length - 1);
}

MomentumBalance::Fit MomentumBalance::FitTo(const Leap& leap, int delay_steps,
                                            Vector3 Step::*reported) const {
  double leaps = 0, both = 0, reports_squared = 0;
  for (size_t i = leap.first - 1; i <= leap.last + 1; ++i) {
    const Step& step = leap.steps[i];
    const Vector3 free = Sum(step.leap, gravity_, -step.step_s);
    const Vector3& is = leap.steps[i + static_cast<size_t>(delay_steps)].*reported;
    leaps += Dot(free, free);
    both += Dot(free, is);
    reports_squared += Dot(is, is);
  }
  if (!(reports_squared > 0)) return {};
  return {.ratio = reports_squared / both,
          .unexplained = 1 - both * both / (leaps * reports_squared)};
}

bool MomentumBalance::IsFirstZero(const Leap& leap) const {
  const Step& begin = leap.steps[leap.first];
  const Step& before = leap.steps[leap.first - 1];
  const double most = kNothing * Length(begin.leap);
  if (Length(begin.leap) < kUnexplained * leap.size || Length(before.reported) > most ||
      Length(begin.reported) > most) {
    return false;
  }
  for (const size_t early : {size_t{0}, size_t{1}}) {
    double unexplained = 0;
    for (size_t i = leap.first + 1; i <= leap.last; ++i) {
      const Step& step = leap.steps[i];
      unexplained +=
          Length(Sum(Sum(step.leap, gravity_, -step.step_s), leap.steps[i - early].reported, -1));
    }
    if (unexplained <= kUnexplained * leap.size + leap.weight) return true;
  }
  return false;
}

void MomentumBalance::Judge(Body& body, uint32_t handle, size_t first, size_t last) {
  Leap leap{.steps = body.steps, .first = first, .last = last};
  Vector3 sum{};
  double way = 0;
  for (size_t i = first; i <= last; ++i) {
    const Step& step = body.steps[i];
    sum = Sum(sum, Sum(step.leap, gravity_, -step.step_s));
    way += Length(step.leap);
  }
  leap.size = Length(sum);
  leap.weight = Gravity() * body.steps[last].step_s;
  // A body that is put elsewhere leaps to and fro; a hand or a joint moves one without a contact.
  const auto touches = [](const Step& step) { return step.touches; };
  const auto all = std::span(body.steps);
  if (leap.size < kLeapSteps * leap.weight || way > 2 * leap.size + leap.weight) return;
  if (std::ranges::none_of(all.subspan(first - 1), touches)) return;
  ++judged_count_;
  const auto fits = [&](std::initializer_list<int> delays, Vector3 Step::*reported) {
    Fit best{};
    for (const int delay : delays) {
      const Fit fit = FitTo(leap, delay, reported);
      if (fit.unexplained < best.unexplained) best = fit;
    }
    return best;
  };
  // The poses are those after the step, or those before it.
  const Fit in_time = fits({0, -1}, &Step::reported);
  const Fit late = fits({1, 2}, &Step::reported);
  const Fit otherwise = fits({0, -1}, &Step::reported_otherwise);
  const bool begins = std::ranges::none_of(
      all.subspan(first - 2, 2), [](const Step& step) { return Length(step.reported) > 0; });
  const bool first_is_zero = begins && IsFirstZero(leap);
  if (first_is_zero && std::ranges::any_of(all.subspan(first - 1, 2), touches)) {
    return Add(EngineMistake::kFirstZero, handle);
  }
  if (in_time.unexplained <= kNothing) {
    if (IsNear(in_time.ratio, 1, kUnexplained)) return NoteRight(body);
    if (IsNear(in_time.ratio, -1, kUnexplained)) return Add(EngineMistake::kReversed, handle);
    if (body.ratios.size() < kMostRatios) body.ratios.push_back(in_time.ratio);
    return;
  }
  if (late.unexplained <= kNothing && IsNear(late.ratio, 1, kUnexplained)) {
    return Add(EngineMistake::kLate, handle);
  }
  if (otherwise.unexplained <= kNothing && IsNear(otherwise.ratio, 1, kUnexplained)) {
    return Add(EngineMistake::kOtherFrame, handle);
  }
  if (begins && IsToldInAll(leap, sum)) return NoteRight(body);
  if (first_is_zero) return Add(EngineMistake::kFirstZero, handle);
  ++body.lost_count;
}

/// An engine may report the whole blow in the last of its steps.
bool MomentumBalance::IsToldInAll(const Leap& leap, const Vector3& sum) {
  Vector3 reported{};
  for (size_t i = leap.first - 1; i <= leap.last; ++i)
    reported = Sum(reported, leap.steps[i].reported);
  return Length(Sum(reported, sum, -1)) <= kUnexplained * leap.size + leap.weight;
}

void MomentumBalance::NoteRight(Body& body) {
  ++right_count_;
  ++body.right_count;
}

void MomentumBalance::CountEqual() {
  std::ranges::sort(reports_, {}, [](const Report& report) {
    return std::tuple(report.handle, report.vertices, report.impulse_newton_seconds);
  });
  touch_count_ += reports_.size();
  pair_touch_count_ += static_cast<uint64_t>(std::ranges::count_if(
      reports_, [](const Report& report) { return report.role != Role::kOnly; }));
  for (size_t i = 1; i < reports_.size(); ++i) {
    const Report &a = reports_[i - 1], &b = reports_[i];
    if (!IsEqual(a, b)) continue;
    equal_count_ += 2;
    if (a.role != b.role && a.role != Role::kOnly && b.role != Role::kOnly) mirrored_count_ += 2;
  }
}

void MomentumBalance::Add(EngineMistake mistake, uint32_t handle) {
  MistakeSize& size = counted_[static_cast<size_t>(mistake)];
  if (size.count++ == 0) size.handle = handle;
}

EngineMistakes MomentumBalance::mistakes() const {
  EngineMistakes found = counted_;
  for (MistakeSize& size : found) {
    if (size.count < kFewestBlows ||
        static_cast<double>(size.count) < kMost * static_cast<double>(judged_count_))
      size = {};
  }
  AddRatios(found);
  MistakeSize& stale = found[static_cast<size_t>(EngineMistake::kStale)];
  for (const auto& [handle, body] : bodies_) {
    if (body.stale_count == 0) continue;
    if (stale.count == 0) stale.handle = handle;
    stale.count += body.stale_count;
  }
  MistakeSize& twice = found[static_cast<size_t>(EngineMistake::kTwice)];
  const auto most_of = [](uint64_t count, uint64_t all) {
    return count >= 2 * kFewestBlows &&
           static_cast<double>(count) >= kMostEqual * static_cast<double>(all);
  };
  const bool equal = most_of(equal_count_, touch_count_) && right_count_ == 0;
  if (equal || most_of(mirrored_count_, pair_touch_count_)) {
    twice.count = std::max(equal ? equal_count_ : 0, mirrored_count_) / 2;
    twice.ratio = 2;
    twice.handle = bodies_.empty() ? 0 : bodies_.begin()->first;
  }
  return found;
}

/// Returns the ratio that most blows of the body have, or nothing.
std::optional<double> MomentumBalance::RatioOfBlows(const Body& body) const {
  std::vector<double> ratios = body.ratios;
  if (ratios.empty()) return std::nullopt;
  const double median = Median(ratios);
  const auto alike = static_cast<uint64_t>(std::ranges::count_if(
      ratios, [&](double ratio) { return IsNear(ratio, median, kRatioError); }));
  const uint64_t judged = ratios.size() + body.right_count + body.lost_count;
  const uint64_t fewest = IsNear(median * step_s_, 1, kForceError) ? 1 : kFewestBlows;
  const bool most = static_cast<double>(alike) >= kMost * static_cast<double>(judged);
  return alike >= fewest && most ? std::optional(median) : std::nullopt;
}

/// Returns the load of a body that rests, over its weight.
double MomentumBalance::RatioOfRest(const Body& body) const {
  return Length(body.rest_reported) / (Gravity() * body.rest_s);
}

/// Returns the mistake that the load of a body shows.
std::optional<EngineMistake> MomentumBalance::ShownByRest(const Body& body) const {
  const double ratio = RatioOfRest(body);
  const bool knows_weight = has_gravity_ && body.flew;
  if (RatioOfBlows(body)) return std::nullopt;
  if (right_count_ == 0 &&
      IsNear(ratio * step_s_, 1, knows_weight ? kForceError : kRestRatioError)) {
    return EngineMistake::kForces;
  }
  if (!knows_weight) return std::nullopt;
  const double upwards =
      -Dot(body.rest_reported, gravity_) / (Length(body.rest_reported) * Gravity());
  if (right_count_ == 0 && upwards < -kSameDirection && IsNear(ratio, 1, kUnexplained)) {
    return EngineMistake::kReversed;
  }
  const bool struck = body.right_count + body.lost_count + body.ratios.size() > 0;
  if (struck && upwards > kSameDirection && IsPartOfSubsteps(ratio, kRestRatioError)) {
    return EngineMistake::kLastSubstep;
  }
  return std::nullopt;
}

/// Fills in what the ratios of all bodies show.
void MomentumBalance::AddRatios(EngineMistakes& found) const {
  struct Candidate {
    uint32_t handle = 0;
    double ratio = 0;
    uint64_t count = 0;
  };
  std::vector<Candidate> candidates;
  const auto tell = [](MistakeSize& size, const Candidate& by) {
    if (size.count == 0) size = {.ratio = by.ratio, .handle = by.handle};
    size.count += by.count;
  };
  const auto mistake = [&found](EngineMistake one) -> MistakeSize& {
    return found[static_cast<size_t>(one)];
  };
  uint64_t rest_count = 0;
  std::map<EngineMistake, std::vector<Candidate>> by_rest;
  for (const auto& [handle, body] : bodies_) {
    if (const std::optional<double> of_blows = RatioOfBlows(body)) {
      candidates.push_back({handle, *of_blows, body.ratios.size()});
    }
    if (body.rest_count < kFewestRestSteps) continue;
    ++rest_count;
    const Candidate rest{handle, RatioOfRest(body), body.rest_count};
    const std::optional<EngineMistake> shown = ShownByRest(body);
    if (shown) by_rest[*shown].push_back(rest);
  }
  for (const auto& [shown, all] : by_rest) {
    if (static_cast<double>(all.size()) < kMost * static_cast<double>(rest_count)) continue;
    for (const Candidate& rest : all) tell(mistake(shown), rest);
    if (shown == EngineMistake::kReversed) mistake(shown).ratio = 0;
  }
  const auto [least, most] = std::ranges::minmax_element(candidates, {}, &Candidate::ratio);
  const bool alike = !candidates.empty() && right_count_ < kFewestBlows &&
                     IsNear(most->ratio, least->ratio, 2 * kRatioError);
  for (const Candidate& candidate : candidates) {
    if (IsNear(candidate.ratio * step_s_, 1, kForceError)) {
      tell(mistake(EngineMistake::kForces), candidate);
    } else if (alike && IsNear(candidate.ratio, 2, kRatioError)) {
      tell(mistake(EngineMistake::kTwice), candidate);
    } else if (alike && IsPartOfSubsteps(candidate.ratio, kRatioError)) {
      tell(mistake(EngineMistake::kLastSubstep), candidate);
    } else {
      tell(mistake(EngineMistake::kOtherMass), candidate);
    }
  }
}

}  // namespace carillon
