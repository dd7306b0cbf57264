// SPDX-License-Identifier: Apache-2.0
#include "server/scene/step_impulses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "server/scene/contact_intake.h"
#include "server/scene/contact_stream.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/recording_target.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;
using ::testing::HasSubstr;

constexpr double kStepS = 0.01;

ObjectImpulse ImpulseAt(const Point& point, const Vector3& newton_seconds) {
  ObjectImpulse impulse = SmallImpulse(1);
  impulse.contact.impulse.location = point;
  impulse.contact.impulse.impulse_newton_seconds = newton_seconds;
  impulse.contact.impulse.duration_s = 1e-3;
  return impulse;
}

class StepImpulsesTest : public RecordedSceneTest {
 protected:
  /// Returns the events of a step with these impulses.
  std::vector<MixerEvent> Strike(const std::vector<ObjectImpulse>& impulses,
                                 const ContactReading& reading = {}) {
    ContactIntake intake(scene_, target_, {.step_s = kStepS, .reading = reading, .blows = &blows_});
    EXPECT_TRUE(intake.BeginStep(0).ok());
    for (const ObjectImpulse& impulse : impulses) intake.Strike(impulse);
    intake.EndStep();
    impulse_count_ = intake.impulse_count();
    rejection_ = intake.last_rejection();
    findings_ = intake.findings();
    return std::exchange(target_.events, {});
  }

  std::vector<BlowRecord> blows_;
  uint64_t impulse_count_ = 0;
  absl::Status rejection_;
  IntakeFindings findings_;
};

TEST_F(StepImpulsesTest, ImpulsesAtOnePointAndTimeBecomeOneEventWithTheirSum) {
  const Point point{0.01, 0.02, 0}, other{0.01, 0.03, 0};
  const auto events = Strike({ImpulseAt(point, {1, 2, 3}), ImpulseAt(other, {7, 7, 7}),
                              ImpulseAt(point, {10, -20, 30}), ImpulseAt(point, {100, 0, 0})});
  ASSERT_EQ(events.size(), 2U);
  EXPECT_THAT(events[0].impulse()->impulse_newton_seconds,
              ElementsAre(FloatEq(111), FloatEq(-18), FloatEq(33)));
  EXPECT_EQ(events[0].ReportCount(), 3U);
  EXPECT_EQ(events[1].ReportCount(), 1U);
  EXPECT_EQ(impulse_count_, 4U);
  EXPECT_EQ(findings_.fast_impulse_count, 1U);  // the last changes 0.45 kg by over 100 m/s
  ASSERT_EQ(blows_.size(), 4U);
  EXPECT_THAT(blows_[2].impulse_newton_seconds, ElementsAre(10, -20, 30));
  EXPECT_FALSE(blows_[2].by_sounds);
}

TEST_F(StepImpulsesTest, ImpulsesThatDifferBecomeEventsOfTheirOwn) {
  const ObjectImpulse impulse = ImpulseAt({0.01, 0.02, 0}, {1, 2, 3});
  std::vector<ObjectImpulse> impulses(7, impulse);
  impulses[1].time_offset_s = 1e-3;
  impulses[2].contact.impulse.duration_s = 2e-3;
  impulses[3].contact.handle = 2;
  impulses[4].contact.impulse.location = SurfacePoint{.triangle = 0};
  impulses[5].contact.impulse.location = Point{0.01, 0.02, 1e-9};
  impulses[6].contact.second = {.handle = 2, .location = Point{0, 0, 0}};
  EXPECT_EQ(Strike(impulses).size(), 8U);  // the last strikes two objects
  std::vector<ObjectImpulse> elastic(3, impulse);
  for (ObjectImpulse& one : elastic) one.contact.impulse.duration_s = std::nullopt;
  EXPECT_EQ(Strike(elastic).size(), 3U);
}

TEST_F(StepImpulsesTest, ManySmallImpulsesAreNotLostBesideALargeOne) {
  const Point point{0.01, 0.02, 0};
  std::vector<ObjectImpulse> impulses(65000, ImpulseAt(point, {1e-5, 0, 0}));
  impulses.insert(impulses.begin(), ImpulseAt(point, {4000, 0, 0}));
  impulses.push_back(ImpulseAt(point, {-4000, 0, 0}));
  const auto events = Strike(impulses);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NEAR(events[0].impulse()->impulse_newton_seconds[0], 0.65, 1e-7);
}

TEST_F(StepImpulsesTest, InTheScenesFrameEachImpulseIsTurnedOnItsOwn) {
  const ObjectImpulse impulse = ImpulseAt({0.01, 0.02, 0}, {1, 2, 3});
  EXPECT_EQ(Strike({impulse, impulse}, {.scene_frame = true}).size(), 2U);
}

TEST_F(StepImpulsesTest, ABadImpulseIsRefusedAndAddsNothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Point point{0.01, 0.02, 0};
  auto events = Strike({ImpulseAt(point, {1, 2, 3}), ImpulseAt(point, {kNan, 0, 0})});
  EXPECT_THAT(rejection_.ToString(), HasSubstr("CONTACT_MALFORMED: "));
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].impulse()->impulse_newton_seconds[0], 1);
  events = Strike({ImpulseAt(point, {1, 2, 3}), ImpulseAt(point, {1e8, 0, 0})});
  EXPECT_THAT(rejection_.ToString(), HasSubstr("IMPULSE_TOO_LARGE: "));
  EXPECT_EQ(events.at(0).impulse()->impulse_newton_seconds[0], 1);
  EXPECT_EQ(events[0].ReportCount(), 1U);
  EXPECT_EQ(impulse_count_, 1U);
}

TEST_F(StepImpulsesTest, EachOfMoreImpulsesThanTheStepKeepsIsHandedOnOnceAndInOrder) {
  constexpr size_t kCount = 10000;
  std::vector<ObjectImpulse> impulses;
  for (size_t i = 0; i < kCount; ++i) {
    const double x = 1e-6 * static_cast<double>(i);
    impulses.push_back(ImpulseAt({x, 0.01, 0}, {static_cast<double>(i) / kCount, 0, 0}));
  }
  const auto events = Strike(impulses);
  ASSERT_EQ(events.size(), kCount);
  for (size_t i = 1; i < kCount; ++i) {
    ASSERT_GT(events[i].impulse()->impulse_newton_seconds[0],
              events[i - 1].impulse()->impulse_newton_seconds[0]);
  }
}

/// Renders impulses that come in one step, or in as many steps at one time.
std::vector<float> Sound(const std::vector<ObjectImpulse>& impulses, bool together,
                         ContactCounts& counts) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene();
  EXPECT_TRUE(scenes.AddObject(scene, 1, SmallModel(), SmallProperties()).ok());
  const auto stream =
      *scenes.OpenContactStream(scene, {.step_s = kStepS, .scheduling_delay_s = 0.01});
  EXPECT_TRUE(stream->intake().BeginStep(0).ok());
  for (const ObjectImpulse& impulse : impulses) {
    stream->intake().Strike(impulse);
    if (together) continue;
    stream->intake().EndStep();
    EXPECT_TRUE(stream->intake().BeginStep(0).ok());
  }
  stream->intake().EndStep();
  std::vector<float> sound(4800 / 128 * 128);
  mixer.Render(sound);
  counts = stream->counts();
  EXPECT_TRUE(stream->settled());
  return sound;
}

TEST(StepImpulses, OneEventSoundsAsItsImpulsesOneByOne) {
  std::vector<ObjectImpulse> impulses;
  for (const double x : {1.0, -0.3, 0.5, 2.0}) impulses.push_back(ImpulseAt({0, 0, 0}, {x, 0, 0}));
  ContactCounts together, apart;
  const std::vector<float> one = Sound(impulses, true, together);
  const std::vector<float> each = Sound(impulses, false, apart);
  double difference = 0, energy = 0;
  for (size_t i = 0; i < one.size(); ++i) {
    difference += std::pow(one[i] - each[i], 2);
    energy += std::pow(each[i], 2);
  }
  EXPECT_GT(energy, 0);
  EXPECT_LT(difference, 1e-11 * energy);
  EXPECT_EQ(together.accepted_count, 4U);
  EXPECT_EQ(apart.accepted_count, 4U);
}

TEST(StepImpulses, AnEventThatComesTooLateOrIsLostCountsAllOfItsImpulses) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene();
  EXPECT_TRUE(scenes.AddObject(scene, 1, SmallModel(), SmallProperties()).ok());
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = kStepS});
  EXPECT_TRUE(stream->intake().BeginStep(0).ok());
  std::vector<float> sound(128 * 20);
  mixer.Render(sound);
  for (int i = 0; i < 3; ++i) stream->intake().Strike(ImpulseAt({0, 0, 0}, {1, 0, 0}));
  stream->intake().EndStep();
  mixer.Render(sound);
  EXPECT_EQ(stream->counts().late_count, 3U);
  EXPECT_TRUE(stream->intake().BeginStep(0.1).ok());
  for (int i = 0; i < 5; ++i) stream->intake().Strike(ImpulseAt({0, 0, 0}, {1, 0, 0}));
  stream->intake().EndStep();
  ASSERT_TRUE(scenes.RemoveObject(scene, 1).ok());
  mixer.Render(sound);
  mixer.Render(sound);
  const ContactCounts counts = stream->counts();
  EXPECT_EQ(counts.accepted_count + counts.dropped_count, 5U);
  EXPECT_TRUE(stream->settled());
}

}  // namespace
}  // namespace carillon
