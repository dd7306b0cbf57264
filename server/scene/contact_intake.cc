// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_intake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/shortest_decimal.h"
#include "proto/cpp/status_macros.h"
#include "server/scene/body_impulses.h"
#include "server/scene/scene_frame.h"
#include "server/scene/yielding_blow.h"
#include "server/synthesis/bank/acceleration_noise.h"

namespace carillon {
namespace {

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

/// Calls `take` with at most kMostContactsAtOnce of `events` at a time.
template <typename T, typename Take>
void ForEachBatch(std::span<T> events, const Take& take) {
  while (!events.empty()) {
    const std::span<T> batch = events.first(std::min(events.size(), kMostContactsAtOnce));
    take(batch);
    events = events.subspan(batch.size());
  }
}

}  // namespace

ContactIntake::ContactIntake(Scene& scene, EventTarget& target, const IntakeSettings& settings)
    : scene_(scene),
      target_(target),
      settings_(settings),
      blows_(settings.blows),
      mapper_(settings.sample_rate_hz,
              settings.mapping.value_or(TimeMapping{.delay_s = settings.delay_s})),
      time_s_(mapper_.mapping().first_time_s),
      diagnostics_(settings.step_s, settings.rejections),
      gatherer_(settings.step_s),
      pose_times_(settings.step_s) {
  if (settings.balances) balance_.emplace(settings.step_s, settings.reading.scene_frame);
}

absl::Status ContactIntake::BeginStep(double time_s, double time_scale) {
  if (!(std::abs(time_s) <= kLargestStepTimeS)) {
    return Invalid(
        "INVALID_STREAM",
        absl::StrCat("time_s of step ", step_count_, " is ", ShortestDecimal(time_s),
                     "; give seconds, at most ", kLargestStepTimeS, " before or after 0"));
  }
  const bool begins = step_count_ == 0 && !settings_.mapping;
  if (!begins && time_s < time_s_) {
    return Invalid("INVALID_STREAM",
                   absl::StrCat("time goes back from ", ShortestDecimal(time_s_), " s to ",
                                ShortestDecimal(time_s), " s at step ", step_count_,
                                "; open another stream for another run"));
  }
  RETURN_IF_ERROR(CheckTimeScale(time_scale, step_count_));
  const double before_s = begins ? time_s : time_s_;
  if (begins || settings_.at_once) mapper_.Begin(time_s, target_.frame());
  const bool resumes = std::exchange(pauses_, time_scale == 0);
  if (pauses_) {
    mapper_.Pause(before_s, time_s, settings_.step_s);
  } else {
    mapper_.SetScale(before_s, time_scale);
  }
  if (!begins && !settings_.at_once && !settings_.mapping && !pauses_) {
    mapper_.Note(time_s, target_.frame(), resumes);
  }
  time_s_ = time_s;
  ++step_count_;
  if (pauses_) return absl::OkStatus();
  Push(gatherer_.Begin(time_s));
  diagnostics_.BeginStep(time_s);
  return absl::OkStatus();
}

void ContactIntake::Strike(std::span<const ObjectImpulse> impulses) {
  if (pauses_) return;
  if (!struck_.HasRoom(impulses.size())) PushStruck();
  const MutexLock lock(&scene_.mutex());
  for (const ObjectImpulse& impulse : impulses) {
    Note(impulse.contact, TryStrike(impulse));
  }
}

absl::Status ContactIntake::TryStrike(const ObjectImpulse& impulse) {
  ASSIGN_OR_RETURN(const double frame, FrameOfImpulse(impulse.time_offset_s));
  // In the scene's frame, a vector would have to be turned into the object's before it is added.
  const bool may_add = !settings_.reading.scene_frame;
  if (StepImpulses::Struck* struck = may_add ? struck_.Find(impulse) : nullptr) {
    return TryAdd(impulse, *struck);
  }
  BodyImpulses impulses;
  RETURN_IF_ERROR(Locate(impulse.contact, PointSource::kClient, 1, impulses));
  diagnostics_.NoteZero(impulse.contact);
  for (size_t i = 0; i < impulses.count; ++i) {
    BlowRecord blow;
    blow.handle = impulses.by[i].handle;
    blow.by_sounds = impulses.count == impulses.by.size();
    if (blow.by_sounds) blow.by = impulses.by[1 - i].handle;
    AddBlow(impulses.by[i].serial, impulses.by[i].event, blow, frame);
    struck_.Append(impulse, impulses.by[i], frame);
  }
  return absl::OkStatus();
}

absl::Status ContactIntake::TryAdd(const ObjectImpulse& impulse, StepImpulses::Struck& struck) {
  const Vector3& added = impulse.contact.impulse.impulse_newton_seconds;
  RETURN_IF_ERROR(Validate(impulse.contact.impulse));
  RETURN_IF_ERROR(diagnostics_.Examine(std::span(&struck.on_body, 1), added, 1));
  diagnostics_.NoteZero(impulse.contact);
  struck.Add(added);
  if (blows_ == nullptr) return absl::OkStatus();
  MixerEvent alone = struck.on_body.event;
  std::ranges::transform(added,
                         std::get<SurfaceImpulse>(alone.action).impulse_newton_seconds.begin(),
                         [](double x) { return static_cast<float>(x); });
  BlowRecord blow;
  blow.handle = struck.on_body.handle;
  AddBlow(struck.on_body.serial, alone, blow, struck.frame);
  return absl::OkStatus();
}

void ContactIntake::Hold(std::span<const ObjectForce> forces) {
  if (pauses_) return;
  diagnostics_.NoteForce();
  const MutexLock lock(&scene_.mutex());
  for (const ObjectForce& force : forces) {
    Note(force.contact, TryHold(force));
  }
}

absl::Status ContactIntake::TryHold(const ObjectForce& force) {
  RETURN_IF_ERROR(Validate(force.roughness));
  RETURN_IF_ERROR(CheckAhead(FrameOf(time_s_)));
  BodyImpulses impulses;
  RETURN_IF_ERROR(Locate(force.contact, PointSource::kClient, settings_.step_s, impulses));
  gatherer_.Add(impulses, force.roughness);
  return absl::OkStatus();
}

void ContactIntake::Touch(std::span<const ObjectTouch> touches) {
  if (pauses_) return;
  diagnostics_.NoteForce();
  const MutexLock lock(&scene_.mutex());
  for (const ObjectTouch& touch : touches) {
    Note(touch.contact, TryTouch(touch));
  }
}

absl::Status ContactIntake::TryTouch(const ObjectTouch& touch) {
  RETURN_IF_ERROR(Validate(touch.roughness));
  RETURN_IF_ERROR(FrameOfImpulse(touch.time_offset_s).status());
  if (diagnostics_.NoteZero(touch.contact)) {
    if (balance_) balance_->TouchWithout(touch.contact.handle);
    return scene_.Find(touch.contact.handle).status();
  }
  if (!gatherer_.HasRoom(touch)) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_CONTACTS",
                   absl::StrCat("a step has more than ", BlowGatherer::kMostTouches,
                                " engine contacts, or more pairs of bodies have touched: report "
                                "fewer points, and give a body the same partner in each step"));
  }
  BodyImpulses impulses;
  RETURN_IF_ERROR(Locate(touch.contact, PointSource::kEngine, 1, impulses));
  using enum MomentumBalance::Role;
  for (const BodyImpulse& one : balance_ ? impulses.all() : std::span<const BodyImpulse>()) {
    balance_->Touch({.handle = one.handle,
                     .mass_kg = one.mass_kg,
                     .impulse_newton_seconds = one.impulse().impulse_newton_seconds,
                     .vertices = one.impulse().at.vertices,
                     .weights = one.impulse().at.weights,
                     .role = impulses.count == 1       ? kOnly
                             : &one == &impulses.by[0] ? kFirst
                                                       : kSecond});
  }
  gatherer_.Touch(touch, impulses);
  return absl::OkStatus();
}

void ContactIntake::Move(uint32_t handle, const Pose& pose, const ReportPlace& place) {
  Note(1, place, TryMove(handle, pose));
}

absl::Status ContactIntake::TryMove(uint32_t handle, const Pose& pose) {
  RETURN_IF_ERROR(CheckAhead(FrameOf(time_s_)));
  const MutexLock lock(&scene_.mutex());
  ASSIGN_OR_RETURN(const SoundingObject* object, scene_.Move(handle, pose));
  moved_ = true;
  if (!pauses_) gatherer_.Move(handle, object->serial, pose);
  if (balance_ && !pauses_) {
    const Quaternion orientation = Normalized(pose.orientation);
    Vector3 centre = object->body->centre_m;
    for (double& component : centre) component *= object->properties.material.size;
    centre = Rotated(centre, orientation);
    for (size_t axis = 0; axis < 3; ++axis) centre[axis] += pose.position_m[axis];
    balance_->Move(handle, centre, orientation);
  }
  if (object->voice == nullptr) return absl::OkStatus();
  const double glide_s = pose_times_.GlideS(handle, time_s_);
  MixerEvent move{.bank = object->bank, .action = ObjectMove{MotionTo(pose, GlideFrames(glide_s))}};
  Push(move, FrameOf(time_s_ - glide_s));
  return absl::OkStatus();
}

void ContactIntake::MoveListener(const Pose& pose) { Note(1, {}, TryMoveListener(pose)); }

absl::Status ContactIntake::TryMoveListener(const Pose& pose) {
  RETURN_IF_ERROR(CheckAhead(FrameOf(time_s_)));
  const MutexLock lock(&scene_.mutex());
  ASSIGN_OR_RETURN(const auto* objects, scene_.MoveListener(pose));
  const double glide_s = pose_times_.GlideS(std::nullopt, time_s_);
  const ListenerMove motion{MotionTo(pose, GlideFrames(glide_s))};
  for (const auto& [handle, object] : *objects) {
    if (object.voice == nullptr) continue;
    MixerEvent move{.bank = object.bank, .action = motion};
    Push(move, FrameOf(time_s_ - glide_s));
  }
  return absl::OkStatus();
}

void ContactIntake::EndStep() {
  if (pauses_) return;
  PushStruck();
  Push(gatherer_.End());
  if (balance_) balance_->EndStep(time_s_);
}

void ContactIntake::Finish() {
  PushStruck();
  Push(gatherer_.Finish());
}

void ContactIntake::Note(uint64_t count, const ReportPlace& place, const absl::Status& verdict) {
  if (verdict.ok()) return;
  Reject(count, place.list == nullptr ? verdict : AtElement(verdict, place.list, place.index));
}

absl::Status ContactIntake::Locate(const ObjectContact& contact, PointSource source, double seconds,
                                   BodyImpulses& impulses) {
  ASSIGN_OR_RETURN(const SoundingObject* object, scene_.Find(contact.handle));
  const SoundingObject* second = nullptr;
  if (contact.second) {
    ASSIGN_OR_RETURN(second, scene_.Find(contact.second->handle));
  }
  RETURN_IF_ERROR(settings_.reading.scene_frame
                      ? FindBodyImpulses(FromSceneFrame(contact, *object, second), source, *object,
                                         second, impulses)
                      : FindBodyImpulses(contact, source, *object, second, impulses));
  if (settings_.reading.gaussian_pulses) {
    for (BodyImpulse& one : impulses.all()) {
      auto& impulse = std::get<SurfaceImpulse>(one.event.action);
      impulse.pulse = Pulse::Gaussian(impulse.pulse.duration_s());
    }
  }
  return diagnostics_.Examine(impulses.all(), contact.impulse.impulse_newton_seconds, seconds);
}

double ContactIntake::AheadS(double frame) const {
  return (frame - static_cast<double>(target_.frame())) / settings_.sample_rate_hz;
}

double ContactIntake::ahead_s() const {
  if (step_count_ == 0) return 0;
  const double frame = FrameOf(time_s_);
  return CheckAhead(frame).ok() ? AheadS(frame) : 0;
}

void ContactIntake::PushStruck() {
  ForEachBatch(struck_.events(),
               [this](std::span<StepImpulses::Struck> batch) { PushStruck(batch); });
  struck_.Clear();
}

void ContactIntake::PushStruck(std::span<StepImpulses::Struck> events) {
  const MutexLock lock(&scene_.mutex());
  for (StepImpulses::Struck& struck : events) {
    MixerEvent& event = struck.on_body.event;
    const absl::StatusOr<const SoundingObject*> object =
        scene_.FindSame(struck.on_body.handle, struck.on_body.serial);
    if (!object.ok()) {
      Reject(event.ReportCount(), object.status());
      continue;
    }
    impulse_count_ += event.ReportCount();
    event.bank = (*object)->bank;
    LetYield(**object, struck.on_body.collision, std::get<SurfaceImpulse>(event.action));
    Push(event, struck.frame);
  }
}

void ContactIntake::Push(std::span<const ForceEvent> events) {
  ForEachBatch(events, [this](std::span<const ForceEvent> batch) {
    const MutexLock lock(&scene_.mutex());
    for (const ForceEvent& force : batch) Push(force);
  });
}

void ContactIntake::Push(const ForceEvent& force) {
  const absl::StatusOr<const SoundingObject*> object = scene_.FindSame(force.handle, force.serial);
  if (!object.ok()) return;
  MixerEvent event{.bank = (*object)->bank, .action = force.action};
  const double frame = FrameOf(force.time_s);
  if (!CheckAhead(frame).ok()) return;  // the end of a force, in a step that was rejected
  if (auto* impulse = std::get_if<SurfaceImpulse>(&event.action)) {
    LetYield(**object, force.collision, *impulse);
    ++impulse_count_;
    BlowRecord blow;
    blow.handle = force.handle;
    blow.by = force.by;
    blow.by_sounds = force.by_sounds;
    AddBlow(force.serial, event, blow, frame);
  } else if (auto* knot = std::get_if<ForceKnot>(&event.action)) {
    knot->step_s /= static_cast<float>(mapping().scale);
  }
  Push(event, frame);
}

void ContactIntake::AddBlow(uint64_t serial, const MixerEvent& event, BlowRecord blow,
                            double frame) {
  if (blows_ == nullptr) return;
  const absl::StatusOr<const SoundingObject*> object = scene_.FindSame(blow.handle, serial);
  if (!object.ok()) return;
  const SurfaceImpulse& impulse = *event.impulse();
  const auto& vertices = (*object)->body->model->vertices;
  for (size_t corner = 0; corner < impulse.at.vertices.size(); ++corner) {
    const std::array<float, 3>& vertex = vertices[impulse.at.vertices[corner]];
    const double weight = impulse.at.weights[corner] * (*object)->properties.material.size;
    for (size_t axis = 0; axis < vertex.size(); ++axis) blow.point_m[axis] += weight * vertex[axis];
  }
  // A contact whose beginning sounds, too, begins no earlier than the first frame (Mixer::Await).
  const double lead_frames =
      (*object)->clicks
          ? AccelerationNoise::PulseFrames(impulse.pulse, settings_.sample_rate_hz) / 2
          : 0;
  const auto first_frame = static_cast<double>(mapping().first_frame);
  blow.time_s =
      (std::max({frame, first_frame + lead_frames, 0.0}) - first_frame) / settings_.sample_rate_hz;
  blow.impulse_newton_seconds = impulse.impulse_newton_seconds;
  blow.duration_s = impulse.pulse.duration_s();
  blows_->push_back(blow);
}

void ContactIntake::Push(MixerEvent& event, double frame) {
  // If steps sound at once, an event of an earlier step may be due before the first frame.
  event.SetTime(std::max(frame, 0.0));
  target_.Push(event);
}

absl::StatusOr<double> ContactIntake::FrameOfImpulse(double time_offset_s) const {
  if (!(time_offset_s >= 0)) {
    return Invalid("CONTACT_MALFORMED", absl::StrCat("the impulse lies ", time_offset_s,
                                                     " s after its step; it must be zero or more"));
  }
  const double frame = FrameOf(time_s_ + time_offset_s);
  RETURN_IF_ERROR(CheckAhead(frame));
  return frame;
}

absl::Status ContactIntake::CheckAhead(double frame) const {
  const double ahead_s = AheadS(frame);
  if (ahead_s <= settings_.most_ahead_s + mapping().delay_s) return absl::OkStatus();
  return Invalid(
      "TIME_TOO_FAR_AHEAD",
      absl::StrCat("the step or impulse is due in ", ahead_s, " s, over ", settings_.most_ahead_s,
                   " s ahead; give times in seconds, and send each step when it "
                   "happens"));
}

}  // namespace carillon
