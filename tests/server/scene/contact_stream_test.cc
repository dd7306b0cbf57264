// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "server/scene/body_impulses.h"
#include "tests/server/scene/stage.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {
namespace {

constexpr size_t kBlock = 64;
constexpr double kRate = 48000;

class ContactStreamTest : public testing::Test, protected Stage {
 protected:
  ContactStreamTest() : Stage({}, {.sample_rate_hz = kRate, .block_frame_count = kBlock}) { Add(); }
};

TEST_F(ContactStreamTest, AContactSoundsAtTheFirstStepsArrivalPlusItsTimePlusTheDelay) {
  for (const double offset_s : {0.25, 0.5 / kRate}) {
    RenderFrames(640);  // the first step arrives at frame 640
    const auto stream = Open(0.02);
    ASSERT_TRUE(stream->intake().BeginStep(100.0).ok());  // this simulation starts at 100 s
    StrikeAt(stream->intake(), 100.5, {SmallImpulse(1, 1, offset_s)});
    // sin(0) is silent, and an impulse between two frames is first heard at the later.
    const double expected = (0.5 + offset_s + 0.02) * kRate + 1;
    EXPECT_EQ(Onset(RenderFrames(480000)), std::floor(expected));
  }
}

TEST_F(ContactStreamTest, TheSecondObjectOfAContactFeelsTheOppositeTurnedIntoItsFrame) {
  ASSERT_EQ(Add(), 2U);
  const auto hear = [this](const ObjectImpulse& impulse) {
    RenderFrames(480000);  // until all has died away
    const auto stream = Open(0);
    StrikeAt(stream->intake(), 0, {impulse});
    std::vector<float> sound = RenderFrames(4864);
    EXPECT_EQ(stream->counts().accepted_count, impulse.contact.second ? 2U : 1U);
    return sound;
  };
  ObjectImpulse pair = SmallImpulse(1);
  pair.contact.second = {.handle = 2, .location = Point{0, 0, 0}};
  // Two equal bodies, struck at once with opposite impulses: nothing is left but rounding, 100 dB
  // below one of them.
  EXPECT_LT(Peak(hear(pair)), 2e-7);
  // Half a turn about z: what was opposite is alike, and both sound as one struck twice as hard.
  pair.contact.second->rotation = Quaternion{.w = 0, .z = 1};
  EXPECT_LT(LargestDifference(hear(pair), hear(SmallImpulse(1, 2))), 1e-6);
}

TEST_F(ContactStreamTest, AnElasticCollisionOfTwoObjectsLastsAsLongForBothByBothsStiffness) {
  ObjectProperties properties = SmallProperties();
  const SoundingObject hard = TryAdd(properties)->object;
  properties.material.young_pa /= 100;
  const SoundingObject soft = TryAdd(properties)->object;
  const auto duration_s = [](const SoundingObject& object, const SoundingObject& other) {
    ObjectContact contact = SmallImpulse(1).contact;
    contact.impulse.duration_s = std::nullopt;
    contact.impulse.hertz = {
        .reduced_mass_kg = 0.1, .reduced_radius_m = 0.02, .approach_speed_m_per_s = 1};
    contact.second = {.handle = 2, .location = Point{0, 0, 0}};
    BodyImpulses impulses;
    EXPECT_TRUE(FindBodyImpulses(contact, PointSource::kClient, object, &other, impulses).ok());
    const float first_s = impulses.by[0].impulse().pulse.duration_s();
    EXPECT_EQ(first_s, impulses.by[1].impulse().pulse.duration_s());
    return first_s;
  };
  EXPECT_FLOAT_EQ(duration_s(hard, soft), duration_s(soft, hard));
  // 1/E goes from 2 to 1 + 100 of its unit, and the duration is its power 2/5.
  EXPECT_NEAR(duration_s(hard, soft) / duration_s(hard, hard), std::pow(50.5, 0.4), 1e-4);
}

TEST_F(ContactStreamTest, WhatComesTooLateSoundsAtOnceAndIsCounted) {
  const auto stream = Open(0.01);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  RenderFrames(4800);  // 0.1 s pass, but the simulator comes to 0.05 s only
  StrikeAt(stream->intake(), 0.05, {SmallImpulse(1), SmallImpulse(1, 1, 1)});
  EXPECT_LE(Onset(Render(1)), 1U);
  EXPECT_EQ(stream->counts().late_count, 1U);
  EXPECT_EQ(stream->counts().accepted_count, 1U);
}

TEST_F(ContactStreamTest, AfterAPauseContactsAreInTimeAgainAndNothingIsCounted) {
  const auto stream = Open(0.02);
  const auto step = [&](int number) {
    StrikeAt(stream->intake(), 512 / kRate * number, {SmallImpulse(1)});
    RenderFrames(512);  // the simulator runs in real time
  };
  for (int number = 0; number < 10; ++number) step(number);
  RenderFrames(96000);  // it loads for two seconds
  for (int number = 10; number < 50; ++number) step(number);
  EXPECT_EQ(stream->counts().remap_count, 0U);
  EXPECT_EQ(stream->counts().late_count, 0U);
  RenderFrames(4800);
  EXPECT_EQ(stream->counts().accepted_count, 50U);
  EXPECT_EQ(*stream->first_frame() % 128, 0U);
  // A simulator that stops after every third step is too slow.
  for (int number = 50; number < 62; ++number) {
    if (number % 3 == 0) RenderFrames(24000);
    step(number);
  }
  EXPECT_EQ(stream->counts().remap_count, 3U);
}

TEST_F(ContactStreamTest, ASteppedPauseAndSlowMotionSpreadContactsWithoutALateOne) {
  const auto stream = Open(0.02);
  double time_s = 0;
  const auto steps = [&](int count, double time_scale) {
    for (int i = 0; i < count; ++i) {
      time_s += time_scale * 512 / kRate;
      ASSERT_TRUE(stream->intake().BeginStep(time_s, time_scale).ok());
      stream->intake().Strike(SmallImpulse(1));
      stream->intake().EndStep();
      RenderFrames(512);
    }
  };
  steps(20, 1);
  steps(100, 0);  // their strikes are left out, and they last longer than the simulator's steps
  steps(40, 0.25);
  steps(20, 4);
  EXPECT_EQ(stream->counts().late_count, 0U);
  EXPECT_EQ(stream->counts().remap_count, 0U);
  RenderFrames(4800);
  EXPECT_EQ(stream->counts().accepted_count, 80U);
  for (const double time_scale : {-1.0, 1e-4, 1e4, std::nan("")}) {
    EXPECT_EQ(ReasonOf(stream->intake().BeginStep(time_s, time_scale)), "INVALID_STREAM");
  }
}

TEST_F(ContactStreamTest, AStallWhoseStepsCatchUpLeavesTheMappingAsItIs) {
  const auto stream = Open(0.02);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  const uint64_t first = *stream->first_frame();
  RenderFrames(48000);
  // A second's steps come at once, the last of them in time.
  for (int number = 1; number <= 100; ++number) {
    ASSERT_TRUE(stream->intake().BeginStep(0.01 * number).ok());
  }
  EXPECT_EQ(stream->counts().remap_count, 0U);
  EXPECT_EQ(stream->first_frame(), first);
}

TEST_F(ContactStreamTest, ASimulatorSlowerThanRealTimeIsMappedAnewAgainAndAgain) {
  const auto stream = Open(0.02);
  for (int number = 0; number < 400; ++number) {
    StrikeAt(stream->intake(), 0.01 * number, {SmallImpulse(1)});
    RenderFrames(512);  // 10.67 ms of sound for 10 ms
  }
  RenderFrames(4800);
  EXPECT_GT(stream->counts().remap_count, 2U);
  EXPECT_GT(stream->counts().accepted_count, stream->counts().late_count);
}

TEST_F(ContactStreamTest, WithAtOnceContactsSoundWhenTheyComeAndNoneIsLate) {
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.01, .at_once = true});
  EXPECT_EQ(stream->scheduling_delay_s(), 0);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  Render(1);  // the mixer goes on between the beginning of a step and its contacts
  stream->intake().Strike(SmallImpulse(1));
  stream->intake().EndStep();
  EXPECT_LE(Onset(RenderFrames(640)), 1U);
  RenderFrames(480000);
  StrikeAt(stream->intake(), 0.01, {SmallImpulse(1, 1, 0.001)});
  RenderFrames(640);
  EXPECT_EQ(stream->counts().accepted_count, 2U);
  EXPECT_EQ(stream->counts().late_count + stream->counts().remap_count, 0U);
  const auto both =
      scenes.OpenContactStream(scene, {.step_s = 0.01, .scheduling_delay_s = 0.1, .at_once = true});
  EXPECT_EQ(ReasonOf(both.status()), "INVALID_STREAM");
}

TEST_F(ContactStreamTest, TheDelayIsOneStepOneBlockAndFiveMillisecondsUnlessGiven) {
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = 1.0 / 60});
  EXPECT_DOUBLE_EQ(stream->scheduling_delay_s(), 1.0 / 60 + kBlock / kRate + 0.005);
  EXPECT_EQ(Open(0)->scheduling_delay_s(), 0);
}

TEST_F(ContactStreamTest, RefusesATimeThatGoesBackOrIsNone) {
  const auto stream = Open(0.01);
  ASSERT_TRUE(stream->intake().BeginStep(1).ok());
  ASSERT_TRUE(stream->intake().BeginStep(1).ok());
  for (const double time_s : {0.5, std::nan(""), std::numeric_limits<double>::infinity(), 1.1e10}) {
    const absl::Status status = stream->intake().BeginStep(time_s);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ReasonOf(status), "INVALID_STREAM");
  }
  EXPECT_EQ(stream->counts().step_count, 2U);
}

}  // namespace
}  // namespace carillon
