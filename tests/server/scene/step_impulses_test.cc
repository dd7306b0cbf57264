// SPDX-License-Identifier: Apache-2.0
#include "server/scene/step_impulses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "tests/server/scene/recording_target.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;

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
    StrikeAt(intake, 0, impulses);
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
  // Each is turned from the scene's frame into the object's on its own.
  EXPECT_EQ(Strike({impulse, impulse}, {.scene_frame = true}).size(), 2U);
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

TEST_F(StepImpulsesTest, ABadImpulseIsRefusedAndAddsNothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const Point point{0.01, 0.02, 0};
  auto events = Strike({ImpulseAt(point, {1, 2, 3}), ImpulseAt(point, {kNan, 0, 0})});
  EXPECT_EQ(ReasonOf(rejection_), "CONTACT_MALFORMED");
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].impulse()->impulse_newton_seconds[0], 1);
  events = Strike({ImpulseAt(point, {1, 2, 3}), ImpulseAt(point, {1e8, 0, 0})});
  EXPECT_EQ(ReasonOf(rejection_), "IMPULSE_TOO_LARGE");
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

TEST(StepImpulses, AnEventThatComesTooLateOrIsLostCountsAllOfItsImpulses) {
  Stage stage;
  stage.Add();
  const auto stream = stage.Open(std::nullopt);
  EXPECT_TRUE(stream->intake().BeginStep(0).ok());
  stage.Render(20);
  const ObjectImpulse impulse = ImpulseAt({0, 0, 0}, {1, 0, 0});
  for (int i = 0; i < 3; ++i) stream->intake().Strike(impulse);
  stream->intake().EndStep();
  stage.Render(20);
  EXPECT_EQ(stream->counts().late_count, 3U);
  StrikeAt(stream->intake(), 0.1, std::vector(4, impulse));
  stage.Render(40);
  EXPECT_EQ(stream->counts().accepted_count, 4U);
  StrikeAt(stream->intake(), 0.3, std::vector(5, impulse));
  ASSERT_TRUE(stage.scenes.RemoveObject(stage.scene, 1).ok());
  stage.Render(40);
  const ContactCounts counts = stream->counts();
  EXPECT_EQ(counts.accepted_count + counts.dropped_count, 9U);
  EXPECT_TRUE(stream->settled());
}

}  // namespace
}  // namespace carillon
