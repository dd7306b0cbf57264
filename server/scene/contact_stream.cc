// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_stream.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr double kNetworkJitterS = 0.005;
constexpr double kLongestDelayS = 10;
/// Impulses between two blocks of the mixer.
constexpr size_t kQueueCapacity = 16384;

absl::Status InvalidStream(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM", message);
}

absl::StatusOr<double> SchedulingDelay(const ContactStreamSettings& settings, const Mixer& mixer) {
  if (!(settings.step_s > 0 && settings.step_s <= 1)) {
    return InvalidStream(absl::StrCat("step_s is ", settings.step_s,
                                      "; say the simulator's step, above 0 and at most 1 s"));
  }
  const double block_s =
      static_cast<double>(mixer.settings().block_frame_count) / mixer.settings().sample_rate_hz;
  const double delay_s =
      settings.scheduling_delay_s.value_or(settings.step_s + block_s + kNetworkJitterS);
  if (!(delay_s >= 0 && delay_s <= kLongestDelayS)) {
    return InvalidStream(
        absl::StrCat("scheduling_delay_s is ", delay_s, "; it must be 0 to ", kLongestDelayS));
  }
  return delay_s;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ContactStream>> ContactStream::Make(
    std::shared_ptr<Scene> scene, Mixer& mixer, const ContactStreamSettings& settings) {
  const absl::StatusOr<double> delay_s = SchedulingDelay(settings, mixer);
  if (!delay_s.ok()) return delay_s.status();
  absl::StatusOr<std::unique_ptr<EventStream>> events = mixer.OpenStream(kQueueCapacity);
  if (!events.ok()) return events.status();
  return std::unique_ptr<ContactStream>(
      new ContactStream(std::move(scene), mixer, settings.step_s, *delay_s, *std::move(events)));
}

ContactStream::ContactStream(std::shared_ptr<Scene> scene, Mixer& mixer, double step_s,
                             double scheduling_delay_s, std::unique_ptr<EventStream> events)
    : scene_(std::move(scene)),
      mixer_(mixer),
      mapping_{.delay_s = scheduling_delay_s},
      events_(std::move(events)),
      forces_(step_s),
      pose_times_(step_s) {}

absl::Status ContactStream::BeginStep(double time_s) {
  if (!std::isfinite(time_s)) {
    return InvalidStream(absl::StrCat("time_s of step ", step_count_, " is ", time_s));
  }
  if (step_count_ == 0) {
    mapping_.first_time_s = time_s;
    mapping_.first_frame = mixer_.frame();
  } else if (time_s < time_s_) {
    return InvalidStream(absl::StrCat("time goes back from ", time_s_, " s to ", time_s,
                                      " s at step ", step_count_,
                                      "; open another stream for another run"));
  }
  forces_.Begin(time_s, [this](auto... force) { PushForce(force...); });
  time_s_ = time_s;
  ++step_count_;
  return absl::OkStatus();
}

void ContactStream::Strike(const ObjectImpulse& impulse) {
  absl::Status status = TryStrike(impulse);
  if (!status.ok()) Reject(impulse.second ? 2 : 1, std::move(status));
}

void ContactStream::Reject(uint64_t count, absl::Status reason) {
  rejected_count_ += count;
  last_rejection_ = std::move(reason);
}

void ContactStream::Hold(const ObjectForce& force) {
  absl::Status status = Validate(force.roughness);
  if (status.ok()) {
    status = Locate(force.handle, force.force, force.second,
                    [&](const FeltContact& felt) { forces_.Add(felt, force.roughness); });
  }
  if (!status.ok()) Reject(force.second ? 2 : 1, std::move(status));
}

void ContactStream::Touch(const ObjectTouch& touch) {
  absl::Status status = Validate(touch.roughness);
  if (status.ok()) {
    status = Locate(touch.handle, touch.impulse, touch.second,
                    [&](const FeltContact& felt) { forces_.Touch(touch, felt); });
  }
  if (!status.ok()) Reject(touch.second ? 2 : 1, std::move(status));
}

void ContactStream::Move(uint32_t handle, const Pose& pose) {
  absl::Status status = scene_->Move(handle, pose, [&](const SoundingObject& object) {
    if (object.voice == nullptr) return;
    const double glide_s = pose_times_.GlideS(handle, time_s_);
    Push(object.bank, ObjectMove{MotionTo(pose, glide_s * mixer_.settings().sample_rate_hz)},
         FrameOf(time_s_ - glide_s));
  });
  if (!status.ok()) Reject(1, std::move(status));
}

void ContactStream::MoveListener(const Pose& pose) {
  if (absl::Status status = Validate(pose); !status.ok()) return Reject(1, std::move(status));
  const double glide_s = pose_times_.GlideS(std::nullopt, time_s_);
  absl::Status status = scene_->MoveListener(pose, [&](const SoundingObject& object) {
    Push(object.bank, ListenerMove{MotionTo(pose, glide_s * mixer_.settings().sample_rate_hz)},
         FrameOf(time_s_ - glide_s));
  });
  if (!status.ok()) Reject(1, std::move(status));
}

void ContactStream::EndStep() {
  forces_.End([this](auto... force) { PushForce(force...); });
}

void ContactStream::PushForce(uint32_t handle, const MixerEvent::Action& action, double time_s) {
  // An object that has gone meanwhile feels nothing more.
  scene_
      ->Use(handle,
            [&](const SoundingObject& object) {
              Push(object.bank, action, FrameOf(time_s));
              return absl::OkStatus();
            })
      .IgnoreError();
}

absl::Status ContactStream::Locate(uint32_t handle, const ContactImpulse& contact,
                                   const std::optional<SecondObject>& second,
                                   absl::FunctionRef<void(const FeltContact&)> use) const {
  const auto take = [&](const absl::StatusOr<FeltContact>& felt) {
    if (felt.ok()) use(*felt);
    return felt.status();
  };
  if (!second) {
    return scene_->Use(
        handle, [&](const SoundingObject& object) { return take(Feel(contact, handle, object)); });
  }
  return scene_->Use(handle, second->handle,
                     [&](const SoundingObject& object, const SoundingObject& other) {
                       return take(Feel(contact, handle, object, *second, other));
                     });
}

absl::Status ContactStream::TryStrike(const ObjectImpulse& impulse) {
  const absl::StatusOr<double> frame = FrameAt(time_s_ + impulse.time_offset_s);
  if (!frame.ok()) return frame.status();
  return Locate(impulse.handle, impulse.impulse, impulse.second, [&](const FeltContact& contact) {
    for (const Felt& felt : contact.all()) {
      Push(felt.bank, felt.impulse, *frame);
    }
  });
}

void ContactStream::Push(BankId bank, const MixerEvent::Action& action, double frame) {
  MixerEvent event{.bank = bank, .action = action};
  SetFrame(event, frame);
  if (event.impulse() != nullptr) ++pushed_count_;
  events_->TryPush(event);  // a full queue is counted by the mixer
}

absl::StatusOr<double> ContactStream::FrameAt(double time_s) const {
  if (!(time_s >= time_s_)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_TIME_OFFSET",
                   absl::StrCat("the impulse lies ", time_s - time_s_,
                                " s after its step; it must be zero or more"));
  }
  const double frame = FrameOf(time_s);
  const double ahead_s =
      (frame - static_cast<double>(mixer_.frame())) / mixer_.settings().sample_rate_hz;
  if (ahead_s > kMaxAheadS + mapping_.delay_s) {
    return Refusal(absl::StatusCode::kInvalidArgument, "TIME_TOO_FAR_AHEAD",
                   absl::StrCat("the impulse is due in ", ahead_s, " s, over ", kMaxAheadS,
                                " s ahead; send steps as they happen, or render a trace offline"));
  }
  return frame;
}

double ContactStream::FrameOf(double time_s) const {
  return mapping_.FrameOf(time_s, mixer_.settings().sample_rate_hz);
}

ContactCounts ContactStream::counts() const {
  return {.step_count = step_count_,
          .accepted_count = events_->accepted_count(),
          .late_count = events_->late_count(),
          .dropped_count = events_->dropped_count(),
          .rejected_count = rejected_count_};
}

bool ContactStream::settled() const {
  const ContactCounts now = counts();
  return now.accepted_count + now.late_count + now.dropped_count >= pushed_count_;
}

}  // namespace carillon
