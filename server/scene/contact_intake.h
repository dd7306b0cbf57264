// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/blow_gatherer.h"
#include "server/scene/blow_record.h"
#include "server/scene/diagnostics.h"
#include "server/scene/momentum_balance.h"
#include "server/scene/object_contact.h"
#include "server/scene/rejection_counts.h"
#include "server/scene/scene.h"
#include "server/scene/scene_space.h"
#include "server/scene/step_impulses.h"
#include "server/scene/time_mapping.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// The largest number of contacts, or of events, for which the scene's mutex is locked once. They
/// take about 20 us.
inline constexpr size_t kMostContactsAtOnce = 64;

/// Takes the events of an intake, and has the clock by which they are late or early.
class EventTarget {
 public:
  virtual ~EventTarget() = default;

  /// Returns the number of the frame that is rendered next.
  virtual uint64_t frame() const = 0;

  virtual void Push(const MixerEvent& event) = 0;
};

/// The conventions by which the contacts of a simulation are read.
struct ContactReading {
  bool scene_frame = false;      ///< whether points and impulses are in the scene's frame
  bool gaussian_pulses = false;  ///< Gaussian pulses instead of raised cosines
};

/// How an intake maps simulation time to frames.
struct IntakeSettings {
  double sample_rate_hz = 48000;
  double step_s = 0;  ///< the simulator's step
  double delay_s = 0;
  /// The mapping, with its own delay, of a simulation that was heard before. If it is absent, the
  /// first step is mapped to the target's frame at the step's arrival.
  std::optional<TimeMapping> mapping = std::nullopt;
  /// Whether each step is mapped to the target's frame at the step's arrival, so that no contact is
  /// late.
  bool at_once = false;
  double most_ahead_s = 60;  ///< limit for TIME_TOO_FAR_AHEAD, not counting the delay
  ContactReading reading{};
  /// If not null, also counts rejected contacts by reason. It must outlive the intake.
  RejectionCounts* rejections = nullptr;
  /// If not null, gets each impulse that is handed on. It must outlive the intake.
  std::vector<BlowRecord>* blows = nullptr;
  /// Whether the impulses are compared with the motion, for the mistakes of findings().
  bool balances = true;
};

/// Takes the reports of a client about one simulation, checks them, locates them on the objects of
/// a scene, and hands them on as events of the mixer. Live streams and offline rendering both use
/// the intake, so that both render a simulation alike and refuse it for the same reasons.
///
///     frame(t) = first frame + (t - time of the first step + delay) rate
///
/// If every step within kLateRunS comes late, for instance after a pause in which a simulator
/// loads, simulation time is mapped anew, as if the newest of these steps were the first.
///
/// A report that cannot be used counts as rejected, once for each object of a contact, and
/// last_rejection() has the reason. Other reports are still used. Only one thread at a time may use
/// an object.
class ContactIntake {
 public:
  /// `scene` and `target` must outlive the intake.
  ContactIntake(Scene& scene, EventTarget& target, const IntakeSettings& settings);

  /// Lists the impulses that are handed on from now on in `blows`, which must outlive the intake,
  /// or nowhere if it is null. Replaces the list of the settings.
  void ListBlowsIn(std::vector<BlowRecord>* blows) { blows_ = blows; }

  /// Begins the step at simulation time `time_s`. `time_scale` is simulation time over time of the
  /// sound since the step before. At zero the simulation pauses: the sound goes on for a step, and
  /// the contacts and forces of the step are left out. Errors: InvalidArgument (INVALID_STREAM: the
  /// time is not finite, over 1e10 s before or after 0, or goes back; the scale is not 0.001 to
  /// 1000).
  absl::Status BeginStep(double time_s, double time_scale = 1);

  /// Each of these three functions locks the scene's mutex once for all contacts that it is given.
  /// Callers give at most kMostContactsAtOnce, so that other threads wait only briefly.
  void Strike(std::span<const ObjectImpulse> impulses);
  void Strike(const ObjectImpulse& impulse) { Strike(std::span(&impulse, 1)); }

  /// Adds forces or touches. They last for one step, and must be reported again in each step until
  /// they end.
  void Hold(std::span<const ObjectForce> forces);
  void Hold(const ObjectForce& force) { Hold(std::span(&force, 1)); }
  void Touch(std::span<const ObjectTouch> touches);
  void Touch(const ObjectTouch& touch) { Touch(std::span(&touch, 1)); }

  /// Sets the pose of an object or of the listener at the time of the step. The object or listener
  /// moves there in a straight line from its previous pose.
  void Move(uint32_t handle, const Pose& pose, const ReportPlace& place = {});
  void MoveListener(const Pose& pose);

  /// Ends the step after all its forces have been reported.
  void EndStep();

  /// Ends the simulation, and hands on the blows that are not over yet.
  void Finish();

  /// Counts `count` contacts that could not be used. Other rejections name the report's place.
  void Reject(uint64_t count, absl::Status reason) {
    diagnostics_.Reject(count, std::move(reason));
  }

  const TimeMapping& mapping() const { return mapper_.mapping(); }
  /// Number of times that simulation time was mapped anew.
  uint64_t remap_count() const { return mapper_.remap_count(); }
  uint64_t step_count() const { return step_count_; }
  /// Returns the frame in which a contact at the time of the newest step is due.
  double newest_frame() const { return FrameOf(time_s_); }
  /// Returns the time from the target's frame to the newest step's, seconds. It is zero before the
  /// first step, and if the newest step is too far ahead to sound.
  double ahead_s() const;
  /// Number of impulses handed on.
  uint64_t impulse_count() const { return impulse_count_; }
  uint64_t rejected_count() const { return diagnostics_.rejected_count(); }
  /// See Diagnostics::last_rejection.
  absl::Status last_rejection() const { return diagnostics_.last_rejection(); }
  IntakeFindings findings() const {
    IntakeFindings findings = diagnostics_.findings(
        gatherer_.counts(), balance_ ? balance_->mistakes() : EngineMistakes{});
    findings.lacks_poses = settings_.reading.scene_frame && !moved_;
    return findings;
  }

 private:
  absl::Status TryStrike(const ObjectImpulse& impulse)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  /// Adds an impulse to one of its step that struck the same point at the same time.
  absl::Status TryAdd(const ObjectImpulse& impulse, StepImpulses::Struck& struck)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  absl::Status TryHold(const ObjectForce& force) ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  absl::Status TryTouch(const ObjectTouch& touch) ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  absl::Status TryMove(uint32_t handle, const Pose& pose);
  absl::Status TryMoveListener(const Pose& pose);
  void Note(uint64_t count, const ReportPlace& place, const absl::Status& verdict);
  void Note(const ObjectContact& contact, const absl::Status& verdict) {
    Note(contact.object_count(), contact.place, verdict);
  }
  /// Finds the objects of a contact and the impulses on them. `seconds` is one for an
  /// impulse, and the step for a force.
  absl::Status Locate(const ObjectContact& contact, PointSource source, double seconds,
                      BodyImpulses& impulses) ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  /// Hands on the impulses of the step so far. Those on an object that was removed meanwhile are
  /// rejected.
  void PushStruck();
  void PushStruck(std::span<StepImpulses::Struck> events);
  void Push(std::span<const ForceEvent> events);
  /// Hands on a force, or a blow, unless its object was removed meanwhile.
  void Push(const ForceEvent& force) ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  void Push(MixerEvent& event, double frame) ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  /// Adds the blow of `event` to the listed blows, unless its object, which has this serial, was
  /// removed meanwhile. `blow` has the handles of the object and of its partner.
  void AddBlow(uint64_t serial, const MixerEvent& event, BlowRecord blow, double frame)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(scene_.mutex());
  absl::StatusOr<double> FrameOfImpulse(double time_offset_s) const;
  /// Returns the time from the target's frame to `frame`, seconds.
  double AheadS(double frame) const;
  /// Errors: InvalidArgument (TIME_TOO_FAR_AHEAD).
  absl::Status CheckAhead(double frame) const;
  double FrameOf(double time_s) const { return mapper_.FrameOf(time_s); }
  double GlideFrames(double glide_s) const {
    return glide_s / mapping().scale * settings_.sample_rate_hz;
  }

  Scene& scene_;
  EventTarget& target_;
  const IntakeSettings settings_;
  std::vector<BlowRecord>* blows_;
  TimeMapper mapper_;
  double time_s_ = 0;
  bool pauses_ = false;  // whether the step is one of a pause
  Diagnostics diagnostics_;
  StepImpulses struck_;
  BlowGatherer gatherer_;
  std::optional<MomentumBalance> balance_;
  PoseTimes pose_times_;
  bool moved_ = false;  // whether a pose of an object has come
  uint64_t step_count_ = 0;
  uint64_t impulse_count_ = 0;
};

}  // namespace carillon
