// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/contact_forces.h"
#include "server/scene/found_blow.h"
#include "server/scene/object_contact.h"
#include "server/scene/rejection_counts.h"
#include "server/scene/scene.h"
#include "server/scene/scene_space.h"
#include "server/scene/time_mapping.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// Where the events of an intake go, and the clock by which they are late or early.
class EventTarget {
 public:
  virtual ~EventTarget() = default;

  /// Number of the frame that is rendered next.
  virtual uint64_t frame() const = 0;

  virtual void Push(const MixerEvent& event) = 0;
};

/// How the contacts of a simulation are to be read.
struct ContactReading {
  bool scene_frame = false;      ///< points and impulses are in the scene's frame
  bool gaussian_pulses = false;  ///< instead of raised cosines
};

/// How an intake maps simulation time to frames.
struct IntakeSettings {
  double sample_rate_hz = 48000;
  double step_s = 0;  ///< the simulator's step
  double delay_s = 0;
  /// The mapping of a simulation that was heard before, with its own delay; absent: the first step
  /// lies at the target's frame when the step comes.
  std::optional<TimeMapping> mapping = std::nullopt;
  /// Each step lies at the target's frame when it comes, so that no contact is late.
  bool at_once = false;
  double most_ahead_s = 60;  ///< limit of TIME_TOO_FAR_AHEAD, not counting the delay
  ContactReading reading{};
  /// Counts rejected contacts, too, by reason; null: nobody wants to know. It must outlive the
  /// intake.
  RejectionCounts* rejections = nullptr;
  /// Gets each impulse that is handed on; null: nobody wants to know. It must outlive the intake.
  std::vector<FoundBlow>* blows = nullptr;
};

/// Counts of the contacts of a simulation that a ContactIntake has found unusual so far.
struct IntakeFindings {
  BlowCounts engine{};
  uint64_t distant_point_count = 0;      ///< farther than 5 % of the object's extent
  double largest_distance_m = 0;         ///< of a point from its object's surface
  uint64_t zero_impulse_count = 0;       ///< contacts without an impulse
  uint64_t too_large_impulse_count = 0;  ///< rejected
};

/// Takes all that a client reports of one simulation, checks it, locates it on the objects of a
/// scene, and hands it on as events of the mixer. Live streams and offline rendering both use it,
/// so that a simulation sounds the same, and is refused for the same reasons, in both.
///
///     frame(t) = first frame + (t - time of the first step + delay) rate
///
/// If every step of kLateRunS comes late, as after a pause in which a simulator loads, time is
/// mapped anew, as if the newest of these steps were the first.
///
/// A report that cannot be used counts as rejected, once for each object of a contact, and the rest
/// goes on; last_rejection() says why. One thread at a time.
class ContactIntake {
 public:
  /// `scene` and `target` must outlive the intake.
  ContactIntake(Scene& scene, EventTarget& target, const IntakeSettings& settings);

  /// Begins the step at simulation time `time_s`. Errors: InvalidArgument (INVALID_STREAM: the time
  /// is not finite or goes back).
  absl::Status BeginStep(double time_s);

  void Strike(const ObjectImpulse& impulse);

  /// Forces and touches last for one step, and are reported again in each step until they end.
  void Hold(const ObjectForce& force);
  void Touch(const ObjectTouch& touch);

  /// The pose of an object, or of the listener, at the time of the step: both move there in a
  /// straight line from the pose given before.
  void Move(uint32_t handle, const Pose& pose);
  void MoveListener(const Pose& pose);

  /// Ends the step: all its forces have been reported.
  void EndStep();

  /// Ends the simulation: blows that an engine spreads over steps are over now.
  void Finish();

  /// Counts `count` contacts that could not be used.
  void Reject(uint64_t count, absl::Status reason);

  const TimeMapping& mapping() const { return mapper_.mapping(); }
  /// How many times simulation time was mapped anew.
  uint64_t remap_count() const { return mapper_.remap_count(); }
  uint64_t step_count() const { return step_count_; }
  /// Impulses handed on.
  uint64_t impulse_count() const { return impulse_count_; }
  uint64_t rejected_count() const { return rejected_count_; }
  /// Why the newest rejected contact could not be used; OK if none was rejected.
  const absl::Status& last_rejection() const { return last_rejection_; }
  IntakeFindings findings() const;

 private:
  absl::Status TryStrike(const ObjectImpulse& impulse);
  absl::Status TryHold(const ObjectForce& force);
  absl::Status TryTouch(const ObjectTouch& touch);
  absl::Status TryMove(uint32_t handle, const Pose& pose);
  absl::Status TryMoveListener(const Pose& pose);
  void Note(uint64_t count, absl::Status verdict);
  /// Finds the objects of a contact and what they feel. `seconds`: one for an impulse, the step for
  /// a force.
  absl::Status Locate(const ObjectContact& contact, double seconds, FeltContact& felt)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  /// Counts the findings about a contact. Errors: InvalidArgument (IMPULSE_TOO_LARGE).
  absl::Status Examine(const FeltContact& felt, double seconds);
  void NoteZero(const ObjectContact& contact);
  void Push(const ContactForces::Events& events);
  void Push(MixerEvent& event, double frame);
  /// Adds the blow of `event`, whose object, partner and frame are given, to the settings' blows.
  void AddBlow(const MixerEvent& event, FoundBlow blow, double frame)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  absl::StatusOr<double> FrameOfImpulse(double time_offset_s) const;
  double FrameOf(double time_s) const { return mapper_.FrameOf(time_s); }

  Scene& scene_;
  EventTarget& target_;
  const IntakeSettings settings_;
  TimeMapper mapper_;
  double time_s_ = 0;
  ContactForces forces_;
  PoseTimes pose_times_;
  uint64_t step_count_ = 0;
  uint64_t impulse_count_ = 0;
  uint64_t rejected_count_ = 0;
  absl::Status last_rejection_;
  IntakeFindings findings_;
};

}  // namespace carillon
