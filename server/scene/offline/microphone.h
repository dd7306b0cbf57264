// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "server/base/pose.h"
#include "server/scene/scene_space.h"

namespace carillon {

enum class MicrophoneKind {
  kOmni,       ///< the pressure, in one channel
  kStereo,     ///< left and right, panned
  kEars,       ///< the left and the right ear of a measured head
  kAmbisonic,  ///< ACN, SN3D
};

/// A microphone of an environment. It looks along -z of its frame; x points to the right, y up.
struct Microphone {
  MicrophoneKind kind = MicrophoneKind::kOmni;
  uint32_t ambisonic_order = 1;  ///< 1 to 3
  /// Pose in the scene's frame or, on an object, in the object's.
  Pose pose{};
  std::optional<uint32_t> object = std::nullopt;  ///< handle of the object that carries it
};

size_t ChannelCountOf(const Microphone& microphone);

/// Returns the space that a microphone hears with the effects of `hearing`. `head` is that of ears.
SceneSpace SpaceOf(const Microphone& microphone, HearingSettings hearing,
                   std::shared_ptr<const Head> head);

/// Returns the pose in the scene of what lies at `pose` in the frame of a body at `body`.
Pose Composed(const Pose& body, const Pose& pose);

}  // namespace carillon
