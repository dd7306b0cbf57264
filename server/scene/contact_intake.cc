// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_intake.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/scene/felt_contact.h"

namespace carillon {
namespace {

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

}  // namespace

ContactIntake::ContactIntake(Scene& scene, EventTarget& target, const IntakeSettings& settings)
    : scene_(scene),
      target_(target),
      settings_(settings),
      mapping_(settings.mapping.value_or(TimeMapping{.delay_s = settings.delay_s})),
      time_s_(mapping_.first_time_s),
      forces_(settings.step_s),
      pose_times_(settings.step_s) {}

absl::Status ContactIntake::BeginStep(double time_s) {
  if (!std::isfinite(time_s)) {
    return Invalid("INVALID_STREAM", absl::StrCat("time_s of step ", step_count_, " is ", time_s));
  }
  if (step_count_ == 0 && !settings_.mapping) {
    mapping_.first_frame = target_.frame();
    mapping_.first_time_s = time_s;
  } else if (time_s < time_s_) {
    return Invalid("INVALID_STREAM",
                   absl::StrCat("time goes back from ", time_s_, " s to ", time_s, " s at step ",
                                step_count_, "; open another stream for another run"));
  }
  Push(forces_.Begin(time_s));
  time_s_ = time_s;
  ++step_count_;
  return absl::OkStatus();
}

void ContactIntake::Strike(const ObjectImpulse& impulse) {
  Note(impulse.contact.object_count(), TryStrike(impulse));
}

absl::Status ContactIntake::TryStrike(const ObjectImpulse& impulse) {
  ASSIGN_OR_RETURN(const double frame, FrameOfImpulse(impulse.time_offset_s));
  FeltContact felt;
  const MutexLock lock(&scene_.mutex());
  RETURN_IF_ERROR(Locate(impulse.contact, felt));
  impulse_count_ += felt.count;
  for (Felt& one : felt.all()) Push(one.event, frame);
  return absl::OkStatus();
}

void ContactIntake::Hold(const ObjectForce& force) {
  Note(force.contact.object_count(), TryHold(force));
}

absl::Status ContactIntake::TryHold(const ObjectForce& force) {
  RETURN_IF_ERROR(Validate(force.roughness));
  FeltContact felt;
  const MutexLock lock(&scene_.mutex());
  RETURN_IF_ERROR(Locate(force.contact, felt));
  forces_.Add(felt, force.roughness);
  return absl::OkStatus();
}

void ContactIntake::Touch(const ObjectTouch& touch) {
  Note(touch.contact.object_count(), TryTouch(touch));
}

absl::Status ContactIntake::TryTouch(const ObjectTouch& touch) {
  RETURN_IF_ERROR(Validate(touch.roughness));
  FeltContact felt;
  const MutexLock lock(&scene_.mutex());
  RETURN_IF_ERROR(Locate(touch.contact, felt));
  forces_.Touch(touch, felt);
  return absl::OkStatus();
}

void ContactIntake::Move(uint32_t handle, const Pose& pose) { Note(1, TryMove(handle, pose)); }

absl::Status ContactIntake::TryMove(uint32_t handle, const Pose& pose) {
  const MutexLock lock(&scene_.mutex());
  ASSIGN_OR_RETURN(const SoundingObject* object, scene_.Move(handle, pose));
  if (object->voice == nullptr) return absl::OkStatus();
  const double glide_s = pose_times_.GlideS(handle, time_s_);
  MixerEvent move{.bank = object->bank,
                  .action = ObjectMove{MotionTo(pose, glide_s * settings_.sample_rate_hz)}};
  Push(move, FrameOf(time_s_ - glide_s));
  return absl::OkStatus();
}

void ContactIntake::MoveListener(const Pose& pose) { Note(1, TryMoveListener(pose)); }

absl::Status ContactIntake::TryMoveListener(const Pose& pose) {
  const MutexLock lock(&scene_.mutex());
  ASSIGN_OR_RETURN(const auto* objects, scene_.MoveListener(pose));
  const double glide_s = pose_times_.GlideS(std::nullopt, time_s_);
  const ListenerMove motion{MotionTo(pose, glide_s * settings_.sample_rate_hz)};
  for (const auto& [handle, object] : *objects) {
    if (object.voice == nullptr) continue;
    MixerEvent move{.bank = object.bank, .action = motion};
    Push(move, FrameOf(time_s_ - glide_s));
  }
  return absl::OkStatus();
}

void ContactIntake::EndStep() { Push(forces_.End()); }

void ContactIntake::Reject(uint64_t count, absl::Status reason) {
  rejected_count_ += count;
  last_rejection_ = std::move(reason);
}

void ContactIntake::Note(uint64_t count, absl::Status verdict) {
  if (!verdict.ok()) Reject(count, std::move(verdict));
}

absl::Status ContactIntake::Locate(const ObjectContact& contact, FeltContact& felt) const {
  ASSIGN_OR_RETURN(const SoundingObject* object, scene_.Find(contact.handle));
  if (!contact.second) return Feel(contact, *object, nullptr, felt);
  ASSIGN_OR_RETURN(const SoundingObject* second, scene_.Find(contact.second->handle));
  return Feel(contact, *object, second, felt);
}

void ContactIntake::Push(const ContactForces::Events& events) {
  for (const ForceEvent& force : events) {
    const MutexLock lock(&scene_.mutex());
    const absl::StatusOr<const SoundingObject*> object = scene_.Find(force.handle);
    if (!object.ok()) continue;  // an object that was removed meanwhile feels no more forces
    MixerEvent event{.bank = (*object)->bank, .action = force.action};
    impulse_count_ += event.impulse() != nullptr ? 1 : 0;
    Push(event, FrameOf(force.time_s));
  }
}

void ContactIntake::Push(MixerEvent& event, double frame) {
  SetFrame(event, frame);
  target_.Push(event);
}

absl::StatusOr<double> ContactIntake::FrameOfImpulse(double time_offset_s) const {
  if (!(time_offset_s >= 0)) {
    return Invalid("INVALID_TIME_OFFSET",
                   absl::StrCat("the impulse lies ", time_offset_s,
                                " s after its step; it must be zero or more"));
  }
  const double frame = FrameOf(time_s_ + time_offset_s);
  const double ahead_s = (frame - static_cast<double>(target_.frame())) / settings_.sample_rate_hz;
  if (ahead_s <= settings_.most_ahead_s + mapping_.delay_s) return frame;
  return Invalid(
      "TIME_TOO_FAR_AHEAD",
      absl::StrCat("the impulse is due in ", ahead_s, " s, over ", settings_.most_ahead_s,
                   " s ahead; send each impulse with the step in which it happens"));
}

}  // namespace carillon
