// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "server/scene/contact_intake.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"

namespace carillon {

/// Keeps the events that an intake hands on.
class RecordingTarget final : public EventTarget {
 public:
  uint64_t frame() const override { return now; }
  void Push(const MixerEvent& event) override { events.push_back(event); }

  uint64_t now = 0;
  std::vector<MixerEvent> events;
};

/// A scene with two objects, and a target of the events that its contacts become.
class RecordedSceneTest : public testing::Test {
 protected:
  RecordedSceneTest() {
    for (const uint32_t handle : {1U, 2U}) Insert(handle, SmallModel());
  }

  void Insert(uint32_t handle, const std::shared_ptr<const ModalModel>& model) {
    const auto placed = scenes_.AddObject(registered_, handle, model, SmallProperties());
    ASSERT_TRUE(scene_.Insert(handle, placed->object).ok());
  }

  Mixer mixer_;
  SceneRegistry scenes_{mixer_};
  Scene scene_{"a scene"};
  const uint64_t registered_ = *scenes_.CreateScene();
  RecordingTarget target_;
};

}  // namespace carillon
