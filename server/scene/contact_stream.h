// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/excitation/contact.h"
#include "server/scene/contact_forces.h"
#include "server/scene/frame_time.h"
#include "server/scene/scene.h"
#include "server/synthesis/mixer.h"

namespace carillon {

/// How a contact stream maps simulation time to audio time.
struct ContactStreamSettings {
  double step_s = 0;  ///< the simulator's step: above 0, at most 1
  /// 0 to 10; absent: one step, one block and 5 ms for the network.
  std::optional<double> scheduling_delay_s = std::nullopt;
};

/// An impulse on an object of the scene, at a time after the step's.
struct ObjectImpulse {
  uint32_t handle = 0;
  double time_offset_s = 0;
  ContactImpulse impulse;
  std::optional<SecondObject> second = std::nullopt;
};

/// What became of a stream's impulses so far.
struct ContactCounts {
  uint64_t step_count = 0;
  uint64_t accepted_count = 0;
  uint64_t late_count = 0;
  uint64_t dropped_count = 0;
  uint64_t rejected_count = 0;
};

/// The contacts of one simulator, from its time to audio frames:
///
///     frame(t) = frame at the arrival of the first step + (t - its time + scheduling delay) rate
///
/// One thread at a time.
class ContactStream {
 public:
  /// Impulses further ahead of the sound than this are rejected (TIME_TOO_FAR_AHEAD).
  static constexpr double kMaxAheadS = 60;

  /// Errors: InvalidArgument (INVALID_STREAM), ResourceExhausted (TOO_MANY_STREAMS).
  static absl::StatusOr<std::unique_ptr<ContactStream>> Make(std::shared_ptr<Scene> scene,
                                                             Mixer& mixer,
                                                             const ContactStreamSettings& settings);

  /// Begins the step at simulation time `time_s`. Errors: InvalidArgument (INVALID_STREAM: the time
  /// is not finite or goes back).
  absl::Status BeginStep(double time_s);

  /// An impulse of that step. Where it cannot be used it is counted as rejected and says why.
  void Strike(const ObjectImpulse& impulse);

  /// A force that lasts, in that step, and a contact that may be a blow or a load. Both must be
  /// said again in each step until they end. Rejected as an impulse is.
  void Hold(const ObjectForce& force);
  void Touch(const ObjectTouch& touch);

  /// Where an object is at that step's time, and where the listener is: they move there from where
  /// they were told to be before. Rejected as an impulse is.
  void Move(uint32_t handle, const Pose& pose);
  void MoveListener(const Pose& pose);

  /// Ends the step: its forces are all known.
  void EndStep();

  /// Counts `count` impulses that could not even be read.
  void Reject(uint64_t count, absl::Status reason);

  double scheduling_delay_s() const { return mapping_.delay_s; }

  /// The mixer's frame at the arrival of the first step, once that has come.
  std::optional<uint64_t> first_frame() const {
    return step_count_ > 0 ? std::optional(mapping_.first_frame) : std::nullopt;
  }

  /// What the mixer has not taken yet is in none of the counts.
  ContactCounts counts() const;

  /// Every impulse has been taken by the mixer: counts() is final.
  bool settled() const;

  /// Why the newest rejected impulse could not be used; OK when none was.
  const absl::Status& last_rejection() const { return last_rejection_; }

 private:
  ContactStream(std::shared_ptr<Scene> scene, Mixer& mixer, double step_s,
                double scheduling_delay_s, std::unique_ptr<EventStream> events);

  absl::Status TryStrike(const ObjectImpulse& impulse);
  absl::Status Locate(uint32_t handle, const ContactImpulse& contact,
                      const std::optional<SecondObject>& second,
                      absl::FunctionRef<void(const FeltContact&)> use) const;
  void Push(BankId bank, const MixerEvent::Action& action, double frame);
  void PushForce(uint32_t handle, const MixerEvent::Action& action, double time_s);
  absl::StatusOr<double> FrameAt(double time_s) const;
  double FrameOf(double time_s) const;

  std::shared_ptr<Scene> scene_;
  Mixer& mixer_;
  TimeMapping mapping_;
  std::unique_ptr<EventStream> events_;
  double time_s_ = 0;
  ContactForces forces_;
  PoseTimes pose_times_;
  uint64_t step_count_ = 0;
  uint64_t pushed_count_ = 0;
  uint64_t rejected_count_ = 0;
  absl::Status last_rejection_;
};

}  // namespace carillon
