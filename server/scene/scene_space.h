// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "server/base/pose.h"
#include "server/synthesis/mixer.h"
#include "server/synthesis/voice/voice.h"

namespace carillon {

/// How a scene is heard, and from where at first.
struct SceneSpace {
  HearingSettings hearing;
  Pose listener;  ///< looks along its frame's -z; x is to its right
};

/// Errors: InvalidArgument (INVALID_HEARING, INVALID_POSE).
absl::Status Validate(const SceneSpace& space);

/// For an object at `pose`, or at the origin; null where its place is not heard.
std::shared_ptr<Voice> MakeVoice(const SceneSpace& space, const std::optional<Pose>& pose,
                                 const MixerSettings& mixer);

/// The motion of an object or of the listener to `pose`.
Motion MotionTo(const Pose& pose, double glide_frames);

/// How long what moves is on its way from pose to pose: one simulation goes step by step, so at
/// most a step.
class PoseTimes {
 public:
  explicit PoseTimes(double step_s) : step_s_(step_s) {}

  /// Seconds before `time_s` at which the way to the pose of that time begins; zero: a jump.
  /// `handle` is an object's; none: the listener's.
  double GlideS(std::optional<uint32_t> handle, double time_s);

 private:
  double step_s_;
  std::map<std::optional<uint32_t>, double> told_s_;
};

}  // namespace carillon
