// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/microphone.h"

#include <utility>

namespace carillon {

size_t ChannelCountOf(const Microphone& microphone) {
  switch (microphone.kind) {
    case MicrophoneKind::kOmni:
      return 1;
    case MicrophoneKind::kAmbisonic:
      return size_t{microphone.ambisonic_order + 1} * (microphone.ambisonic_order + 1);
    case MicrophoneKind::kStereo:
    case MicrophoneKind::kEars:
      break;
  }
  return 2;
}

SceneSpace SpaceOf(const Microphone& microphone, HearingSettings hearing,
                   std::shared_ptr<const Head> head) {
  hearing.panning = microphone.kind == MicrophoneKind::kStereo;
  hearing.binaural = microphone.kind == MicrophoneKind::kEars;
  hearing.ambisonic = microphone.kind == MicrophoneKind::kAmbisonic;
  return {.hearing = hearing,
          .listener = microphone.pose,
          .head = hearing.binaural ? std::move(head) : nullptr};
}

Pose Composed(const Pose& body, const Pose& pose) {
  const Vector3 away_m = Rotated(pose.position_m, body.orientation);
  Pose composed = body;
  for (size_t axis = 0; axis < away_m.size(); ++axis) composed.position_m[axis] += away_m[axis];
  composed.orientation = Normalized(Product(body.orientation, pose.orientation));
  return composed;
}

}  // namespace carillon
