// SPDX-License-Identifier: Apache-2.0
//
// Changes of a scene while contacts come for its objects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "server/scene/contact_intake.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/recording_target.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

constexpr double kStepS = 0.01;

TEST(SceneChanges, AnUpdateKeepsThePoseThatAContactStreamSetsWhileTheBankIsMade) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene();
  const uint32_t handle = scenes.AddObject(scene, 0, SmallModel(), SmallProperties())->handle;
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.01, .scheduling_delay_s = 0});
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  std::atomic<bool> done{false};
  std::thread updates([&] {
    ObjectChange change;
    for (int i = 0; i < 1000; ++i) {
      change.gain = 1 + i % 2;
      EXPECT_TRUE(scenes.UpdateObject(scene, handle, change).ok());
    }
    done = true;
  });
  double lost_count = 0;
  for (double x = 1; !done; ++x) {
    stream->intake().Move(handle, {.position_m = {x, 0, 0}});
    for (int look = 0; look < 20; ++look) {
      const PlacedObject placed = scenes.ListObjects(scene)->front();
      lost_count += placed.object.properties.pose->position_m[0] == x ? 0 : 1;
    }
  }
  updates.join();
  EXPECT_EQ(lost_count, 0);
}

TEST(SceneChanges, AFloodOfMovesInOneSceneDelaysNoOther) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  const HearingSettings hearing{.distance_gain = true};
  const uint64_t scene = *scenes.CreateScene({.hearing = hearing, .listener = {}});
  ObjectProperties properties = SmallProperties();
  properties.pose = Pose{.position_m = {-1, 0, 0}};
  const uint32_t handle = scenes.AddObject(scene, 0, SmallModel(), properties)->handle;
  ObjectChange move;
  move.pose = Pose{.position_m = {1, 0, 0}};
  absl::Status status;
  // Nothing renders, so that nothing takes the moves.
  while (status.ok()) status = scenes.UpdateObject(scene, handle, move).status();
  const uint64_t other = *scenes.CreateScene({.hearing = hearing, .listener = {}});
  const uint32_t calm = scenes.AddObject(other, 0, SmallModel(), properties)->handle;
  EXPECT_TRUE(scenes.UpdateObject(other, calm, move).ok());
  EXPECT_TRUE(scenes.UpdateListener(other, {.position_m = {0, 0, 1}}, 0).ok());
}

TEST(SceneChanges, AnImpulseOnAnObjectThatIsRemovedBeforeTheStepEndsIsRejected) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  Scene scene("a scene");
  const uint64_t registered = *scenes.CreateScene();
  const SoundingObject object =
      scenes.AddObject(registered, 1, SmallModel(), SmallProperties())->object;
  RecordingTarget target;
  std::vector<BlowRecord> blows;
  ContactIntake intake(scene, target, {.step_s = kStepS, .blows = &blows});
  double time_s = 0;
  // Another object that gets the handle meanwhile may have another surface.
  for (const bool another_comes : {false, true}) {
    ASSERT_TRUE(scene.Insert(1, object).ok());
    ASSERT_TRUE(intake.BeginStep(time_s).ok());
    intake.Strike(SmallImpulse(1));
    intake.Touch({.contact = SmallImpulse(1).contact, .partner = 2});
    intake.Hold({.contact = SmallImpulse(1).contact});
    ASSERT_TRUE(scene.Remove(1).ok());
    if (another_comes) {
      ASSERT_TRUE(scene.Insert(1, object).ok());
    }
    intake.Strike(SmallImpulse(1));  // added to the first, whose point it strikes
    const uint64_t rejected_before = intake.rejected_count();
    intake.EndStep();
    EXPECT_EQ(target.events.size(), 0U);
    EXPECT_EQ(intake.impulse_count(), 0U);
    EXPECT_EQ(intake.rejected_count(), rejected_before + 2);
    EXPECT_THAT(intake.last_rejection().ToString(), HasSubstr("OBJECT_NOT_FOUND: "));
    time_s += 1;
  }
  EXPECT_EQ(blows.size(), 2U) << "the impulses on the objects that were there";
}

TEST(SceneChanges, AnImpulseOnAnObjectThatIsChangedBeforeTheStepEndsGoesToTheNewBank) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  Scene scene("a scene");
  const uint64_t registered = *scenes.CreateScene();
  const auto made = [&] {
    return scenes.AddObject(registered, 0, SmallModel(), SmallProperties())->object;
  };
  ASSERT_TRUE(scene.Insert(1, made()).ok());
  RecordingTarget target;
  ContactIntake intake(scene, target, {.step_s = kStepS});
  ASSERT_TRUE(intake.BeginStep(0).ok());
  intake.Strike(SmallImpulse(1));
  const SoundingObject changed = made();
  ASSERT_TRUE(scene.Replace(1, changed).ok());
  intake.EndStep();
  ASSERT_EQ(target.events.size(), 1U);
  EXPECT_EQ(target.events[0].bank, changed.bank);
  EXPECT_EQ(intake.impulse_count(), 1U);
}

}  // namespace
}  // namespace carillon
