// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "absl/status/status.h"
#include "server/scene/blow_gatherer.h"
#include "server/scene/body_impulses.h"
#include "server/scene/momentum_balance.h"
#include "server/scene/object_contact.h"
#include "server/scene/rejection_counts.h"
#include "server/scene/step_intervals.h"

namespace carillon {

/// The numbers of unusual contacts that a ContactIntake has found so far in a simulation.
struct IntakeFindings {
  BlowCounts engine{};
  uint64_t distant_point_count = 0;      ///< points farther from the surface than 5 % of the extent
  double largest_distance_m = 0;         ///< largest distance of a point from its object's surface
  bool lacks_poses = false;              ///< whether the frame is the scene's, and no pose has come
  uint64_t zero_impulse_count = 0;       ///< contacts without an impulse
  uint64_t too_large_impulse_count = 0;  ///< contacts rejected for their impulse
  double regular_gap_s = 0;              ///< see StepIntervals::RegularGapS
  uint64_t fast_impulse_count = 0;       ///< impulses that change a speed by over 100 m/s
  double largest_speed_change_m_per_s = 0;
  /// Steps with touches or forces at the time of the step before. Zero unless there are at least
  /// ten, a fifth of all steps with touches or forces.
  uint64_t standing_step_count = 0;
  EngineMistakes mistakes{};
};

/// Counts what is unusual about the contacts of a simulation, and which contacts are rejected. Only
/// one thread at a time may use an object.
class Diagnostics {
 public:
  /// `step_s` is the stated step of the simulator, seconds. `rejections`, if not null, also counts
  /// the rejected contacts by reason.
  Diagnostics(double step_s, RejectionCounts* rejections)
      : rejections_(rejections), intervals_(step_s) {}

  /// Begins the step at simulation time `time_s`.
  void BeginStep(double time_s);

  /// Counts the step of a touch or a force.
  void NoteForce();

  /// Counts a contact without an impulse. Returns whether it is one.
  bool NoteZero(const ObjectContact& contact);

  /// Counts unusual properties of a contact. `vector` is its impulse, or a force that lasts for
  /// `seconds`. Errors: InvalidArgument (IMPULSE_TOO_LARGE).
  absl::Status Examine(std::span<const BodyImpulse> impulses, const Vector3& vector,
                       double seconds);

  /// Counts `count` contacts that could not be used.
  void Reject(uint64_t count, absl::Status reason);

  uint64_t rejected_count() const { return rejected_count_; }

  /// Returns the reason of the newest rejection, with the time of its step if there are several
  /// steps, and of several rejections their number and the time of the first. Returns OK if no
  /// contact was rejected.
  absl::Status last_rejection() const;

  IntakeFindings findings(const BlowCounts& engine, const EngineMistakes& mistakes) const;

 private:
  void NoteSpeedChange(double speed_m_per_s);

  RejectionCounts* const rejections_;
  StepIntervals intervals_;
  std::optional<double> time_s_;  // of the newest step
  uint64_t step_count_ = 0;
  bool stands_ = false;     // whether this step has the time of the last one
  bool has_force_ = false;  // whether this step has a touch or a force
  uint64_t force_step_count_ = 0;
  uint64_t rejected_count_ = 0;
  absl::Status last_rejection_;
  double first_rejected_time_s_ = 0, last_rejected_time_s_ = 0;
  IntakeFindings findings_;
};

}  // namespace carillon
