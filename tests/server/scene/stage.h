// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/cpp/error_reason.h"
#include "server/scene/contact_stream.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"

namespace carillon {

inline std::string ReasonOf(const absl::Status& refusal) { return ToErrorInfo(refusal).reason(); }

/// A step at `time_s` in which these impulses strike.
inline void StrikeAt(ContactIntake& intake, double time_s,
                     const std::vector<ObjectImpulse>& impulses) {
  ASSERT_TRUE(intake.BeginStep(time_s).ok());
  for (const ObjectImpulse& impulse : impulses) intake.Strike(impulse);
  intake.EndStep();
}

/// A mixer with one scene, and what it renders.
class Stage {
 public:
  explicit Stage(const SceneSpace& space = {}, const MixerSettings& settings = {},
                 TransferStore* transfers = nullptr)
      : mixer(settings), scenes(mixer, transfers), scene(*scenes.CreateScene(space)) {}

  absl::StatusOr<PlacedObject> TryAdd(const ObjectProperties& properties) {
    return scenes.AddObject(scene, 0, model, properties);
  }
  uint32_t Add(const ObjectProperties& properties = SmallProperties()) {
    return TryAdd(properties)->handle;
  }

  std::unique_ptr<ContactStream> Open(std::optional<double> delay_s = 0) {
    return *scenes.OpenContactStream(scene, {.step_s = 0.01, .scheduling_delay_s = delay_s});
  }

  void Strike(uint32_t handle, double newton_seconds = 1) {
    const auto stream = Open();
    StrikeAt(stream->intake(), 0, {SmallImpulse(handle, newton_seconds)});
    ASSERT_EQ(stream->counts().rejected_count, 0U);
  }

  /// As many whole blocks as have `frame_count` frames.
  std::vector<float> RenderFrames(size_t frame_count) {
    const size_t block = mixer.settings().block_frame_count;
    return Render((frame_count + block - 1) / block);
  }
  std::vector<float> Render(size_t block_count) {
    const MixerSettings& settings = mixer.settings();
    std::vector<float> sound(block_count * settings.block_frame_count * settings.channel_count);
    mixer.Render(sound);
    return sound;
  }

  std::shared_ptr<const ModalModel> model = SmallModel();
  Mixer mixer;
  SceneRegistry scenes;
  uint64_t scene;
};

}  // namespace carillon
