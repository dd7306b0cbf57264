// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "server/scene/contact_intake.h"
#include "tests/server/scene/stage.h"

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
class RecordedSceneTest : public testing::Test, protected Stage {
 protected:
  RecordedSceneTest() {
    for (const uint32_t handle : {1U, 2U}) EXPECT_TRUE(scene_.Insert(handle, Made()).ok());
  }

  SoundingObject Made() { return TryAdd(SmallProperties())->object; }

  Scene scene_{"a scene"};
  RecordingTarget target_;
};

}  // namespace carillon
