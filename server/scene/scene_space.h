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

/// The spatial effects of a scene, and the pose of its listener.
struct SceneSpace {
  HearingSettings hearing;
  Pose listener;  ///< the listener looks along -z of this frame; x points to the right, y up
  /// The listener's head for binaural rendering, which `hearing.binaural` asks for. Null if the
  /// scene is not rendered binaurally.
  std::shared_ptr<const Head> head = nullptr;

  bool operator==(const SceneSpace&) const = default;
};

/// Checks a space. Errors: InvalidArgument (INVALID_SETTINGS, INVALID_POSE).
absl::Status Validate(const SceneSpace& space);

/// Makes the voice of an object at `pose`, or at the origin. Returns null for a scene without
/// spatial effects.
std::shared_ptr<Voice> MakeVoice(const SceneSpace& space, const std::optional<Pose>& pose,
                                 const MixerSettings& mixer);

/// The motion of an object or of the listener to `pose`.
Motion MotionTo(const Pose& pose, double glide_frames);

/// Computes the time that an object or the listener takes from one pose to the next. This time is
/// at most one step of the simulation.
class PoseTimes {
 public:
  explicit PoseTimes(double step_s) : step_s_(step_s) {}

  /// Returns the duration of the movement that ends in the pose at `time_s`, seconds. Zero means a
  /// jump. Without a `handle`, the pose is the listener's.
  double GlideS(std::optional<uint32_t> handle, double time_s);

 private:
  double step_s_;
  std::map<std::optional<uint32_t>, double> reported_s_;
};

}  // namespace carillon
