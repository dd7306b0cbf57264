// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/scene/body_impulses.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using testing::HasSubstr;

constexpr size_t kBlock = 64;
constexpr double kRate = 48000;

class ContactStreamTest : public testing::Test {
 protected:
  ContactStreamTest() {
    EXPECT_TRUE(scenes_.AddObject(scene_, 1, SmallModel(), SmallProperties()).ok());
  }

  std::unique_ptr<ContactStream> Open(double scheduling_delay_s) {
    return *scenes_.OpenContactStream(scene_,
                                      {.step_s = 0.01, .scheduling_delay_s = scheduling_delay_s});
  }

  std::vector<float> Render(size_t frame_count) {
    std::vector<float> sound((frame_count + kBlock - 1) / kBlock * kBlock);
    mixer_.Render(sound);
    return sound;
  }

  /// Number of the first frame that is not silent, counted from the start of `sound`.
  static size_t Onset(const std::vector<float>& sound) {
    return static_cast<size_t>(std::ranges::find_if(sound, [](float x) { return x != 0; }) -
                               sound.begin());
  }

  Mixer mixer_{MixerSettings{.sample_rate_hz = kRate, .block_frame_count = kBlock}};
  SceneRegistry scenes_{mixer_};
  uint64_t scene_ = *scenes_.CreateScene();
};

TEST_F(ContactStreamTest, AContactSoundsAtTheFirstStepsArrivalPlusItsTimePlusTheDelay) {
  Render(640);  // the first step arrives at frame 640
  const auto stream = Open(0.02);
  ASSERT_TRUE(stream->intake().BeginStep(100.0).ok());  // this simulation starts at 100 s
  ASSERT_TRUE(stream->intake().BeginStep(100.5).ok());
  stream->intake().Strike(SmallImpulse(1, 1, 0.25));
  stream->intake().EndStep();
  const double expected = (0.5 + 0.25 + 0.02) * kRate;
  EXPECT_EQ(Onset(Render(40000)), expected + 1);  // sin(0) is silent
}

/// On object 1, by object 2 at the same place of its own.
ObjectImpulse PairImpulse(const std::optional<Quaternion>& rotation = std::nullopt) {
  ObjectImpulse impulse = SmallImpulse(1);
  impulse.contact.second = {.handle = 2, .location = Point{0, 0, 0}, .rotation = rotation};
  return impulse;
}

TEST_F(ContactStreamTest, TheSecondObjectOfAContactFeelsTheOpposite) {
  ASSERT_TRUE(scenes_.AddObject(scene_, 2, SmallModel(), SmallProperties()).ok());
  const auto stream = Open(0);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  stream->intake().Strike(PairImpulse());
  stream->intake().EndStep();
  // Two equal bodies, struck at once with opposite impulses: nothing is left but rounding, 100 dB
  // below one of them.
  for (const float sample : Render(4800)) EXPECT_LT(std::abs(sample), 2e-7);
  EXPECT_EQ(stream->counts().accepted_count, 2U);
}

TEST_F(ContactStreamTest, TheImpulseOnTheSecondObjectIsTurnedIntoItsFrame) {
  ASSERT_TRUE(scenes_.AddObject(scene_, 2, SmallModel(), SmallProperties()).ok());
  const auto stream = Open(0);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  // Half a turn about z: what was opposite is alike, and both sound as one struck twice as hard.
  stream->intake().Strike(PairImpulse(Quaternion{.w = 0, .z = 1}));
  stream->intake().EndStep();
  const std::vector<float> both = Render(4800);
  Mixer alone;
  SceneRegistry scenes(alone);
  const uint64_t scene = *scenes.CreateScene();
  ASSERT_TRUE(scenes.AddObject(scene, 1, SmallModel(), SmallProperties()).ok());
  const auto other = *scenes.OpenContactStream(scene, {.step_s = 0.01, .scheduling_delay_s = 0});
  ASSERT_TRUE(other->intake().BeginStep(0).ok());
  other->intake().Strike(SmallImpulse(1, 2));
  other->intake().EndStep();
  std::vector<float> twice(4864);
  alone.Render(twice);
  for (size_t n = 0; n < both.size(); ++n) EXPECT_NEAR(both[n], twice[n], 1e-6) << n;
}

TEST_F(ContactStreamTest, AContactWithAnUnknownSecondObjectIsRejectedForBoth) {
  const auto stream = Open(0);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  stream->intake().Strike(PairImpulse());
  stream->intake().EndStep();
  EXPECT_EQ(stream->counts().rejected_count, 2U);
  EXPECT_THAT(stream->last_rejection().ToString(), HasSubstr("OBJECT_NOT_FOUND"));
  ASSERT_TRUE(scenes_.AddObject(scene_, 2, SmallModel(), SmallProperties()).ok());
  stream->intake().Strike(PairImpulse(Quaternion{.w = 2}));
  stream->intake().EndStep();
  EXPECT_EQ(stream->counts().rejected_count, 4U);
  EXPECT_THAT(stream->last_rejection().ToString(), HasSubstr("INVALID_POSE"));
  EXPECT_EQ(Onset(Render(4800)), 4800U);
}

TEST_F(ContactStreamTest, AnElasticCollisionOfTwoObjectsLastsAsLongForBothByBothsStiffness) {
  ObjectProperties soft = SmallProperties();
  soft.material.young_pa /= 100;
  ASSERT_TRUE(scenes_.AddObject(scene_, 2, SmallModel(), SmallProperties()).ok());
  ASSERT_TRUE(scenes_.AddObject(scene_, 3, SmallModel(), soft).ok());
  const auto find = [&](uint32_t first, uint32_t second) {
    ObjectContact contact = SmallImpulse(first).contact;
    contact.impulse.duration_s = std::nullopt;
    contact.impulse.hertz = {
        .reduced_mass_kg = 0.1, .reduced_radius_m = 0.02, .approach_speed_m_per_s = 1};
    contact.second = {.handle = second, .location = Point{0, 0, 0}};
    const SoundingObject object = scenes_.UpdateObject(scene_, first, {})->object;
    const SoundingObject other = scenes_.UpdateObject(scene_, second, {})->object;
    BodyImpulses impulses;
    EXPECT_TRUE(FindBodyImpulses(contact, PointSource::kClient, object, &other, impulses).ok());
    return impulses;
  };
  const BodyImpulses hard = find(1, 2), mixed = find(1, 3), reversed = find(3, 1);
  EXPECT_EQ(hard.by[0].impulse().pulse.duration_s(), hard.by[1].impulse().pulse.duration_s());
  EXPECT_EQ(mixed.by[0].impulse().pulse.duration_s(), mixed.by[1].impulse().pulse.duration_s());
  EXPECT_FLOAT_EQ(mixed.by[0].impulse().pulse.duration_s(),
                  reversed.by[0].impulse().pulse.duration_s());
  // 1/E goes from 2 to 1 + 100 of its unit, and the duration is its power 2/5.
  EXPECT_NEAR(mixed.by[0].impulse().pulse.duration_s() / hard.by[0].impulse().pulse.duration_s(),
              std::pow(50.5, 0.4), 1e-4);
}

TEST_F(ContactStreamTest, AnImpulseBetweenTwoFramesIsFirstHeardAtTheLater) {
  const auto stream = Open(0.02);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  stream->intake().Strike(SmallImpulse(1, 1, 0.5 / kRate));
  stream->intake().EndStep();
  EXPECT_EQ(Onset(Render(4800)), 0.02 * kRate + 1);
}

TEST_F(ContactStreamTest, WhatComesTooLateSoundsAtOnceAndIsCounted) {
  const auto stream = Open(0.01);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  Render(4800);  // 0.1 s pass, but the simulator comes to 0.05 s only
  ASSERT_TRUE(stream->intake().BeginStep(0.05).ok());
  stream->intake().Strike(SmallImpulse(1));
  stream->intake().Strike(SmallImpulse(1, 1, 1));
  stream->intake().EndStep();
  EXPECT_LE(Onset(Render(kBlock)), 1U);
  EXPECT_EQ(stream->counts().late_count, 1U);
  EXPECT_EQ(stream->counts().accepted_count, 1U);
}

TEST_F(ContactStreamTest, AfterAPauseContactsAreInTimeAgainAndNothingIsCounted) {
  const auto stream = Open(0.02);
  const auto step = [&](int number) {
    ASSERT_TRUE(stream->intake().BeginStep(512 / kRate * number).ok());
    stream->intake().Strike(SmallImpulse(1));
    stream->intake().EndStep();
    Render(512);  // the simulator runs in real time
  };
  for (int number = 0; number < 10; ++number) step(number);
  Render(96000);  // it loads for two seconds
  for (int number = 10; number < 50; ++number) step(number);
  EXPECT_EQ(stream->counts().remap_count, 0U);
  EXPECT_EQ(stream->counts().late_count, 0U);
  Render(4800);
  EXPECT_EQ(stream->counts().accepted_count, 50U);
  EXPECT_EQ(*stream->first_frame() % 128, 0U);
  // A simulator that stops after every third step is too slow.
  for (int number = 50; number < 62; ++number) {
    if (number % 3 == 0) Render(24000);
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
      Render(512);
    }
  };
  steps(20, 1);
  steps(100, 0);  // their strikes are left out, and they last longer than the simulator's steps
  steps(40, 0.25);
  steps(20, 4);
  EXPECT_EQ(stream->counts().late_count, 0U);
  EXPECT_EQ(stream->counts().remap_count, 0U);
  Render(4800);
  EXPECT_EQ(stream->counts().accepted_count, 80U);
  for (const double time_scale : {-1.0, 1e-4, 1e4, std::nan("")}) {
    EXPECT_THAT(stream->intake().BeginStep(time_s, time_scale).ToString(),
                HasSubstr("INVALID_STREAM"));
  }
}

TEST_F(ContactStreamTest, AStallWhoseStepsCatchUpLeavesTheMappingAsItIs) {
  const auto stream = Open(0.02);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  const uint64_t first = *stream->first_frame();
  Render(48000);
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
    ASSERT_TRUE(stream->intake().BeginStep(0.01 * number).ok());
    stream->intake().Strike(SmallImpulse(1));
    stream->intake().EndStep();
    Render(512);  // 10.67 ms of sound for 10 ms
  }
  Render(4800);
  EXPECT_GT(stream->counts().remap_count, 2U);
  EXPECT_GT(stream->counts().accepted_count, stream->counts().late_count);
}

TEST_F(ContactStreamTest, WithAtOnceContactsSoundWhenTheyComeAndNoneIsLate) {
  const auto stream = *scenes_.OpenContactStream(scene_, {.step_s = 0.01, .at_once = true});
  EXPECT_EQ(stream->scheduling_delay_s(), 0);
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  Render(kBlock);  // the mixer goes on between the beginning of a step and its contacts
  stream->intake().Strike(SmallImpulse(1));
  stream->intake().EndStep();
  EXPECT_LE(Onset(Render(640)), 1U);
  Render(480000);
  ASSERT_TRUE(stream->intake().BeginStep(0.01).ok());
  stream->intake().Strike(SmallImpulse(1, 1, 0.001));
  stream->intake().EndStep();
  Render(640);
  EXPECT_EQ(stream->counts().accepted_count, 2U);
  EXPECT_EQ(stream->counts().late_count + stream->counts().remap_count, 0U);
  const auto both = scenes_.OpenContactStream(
      scene_, {.step_s = 0.01, .scheduling_delay_s = 0.1, .at_once = true});
  EXPECT_THAT(both.status().ToString(), HasSubstr("INVALID_STREAM"));
}

TEST_F(ContactStreamTest, TheDelayIsOneStepOneBlockAndFiveMillisecondsUnlessGiven) {
  const auto stream = *scenes_.OpenContactStream(scene_, {.step_s = 1.0 / 60});
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
    EXPECT_THAT(status.ToString(), HasSubstr("INVALID_STREAM: "));
  }
  EXPECT_EQ(stream->counts().step_count, 2U);
}

}  // namespace
}  // namespace carillon
