// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/performance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

#include "server/scene/offline/offline_renderer.h"
#include "tests/server/scene/stage.h"
#include "tests/server/synthesis/sound.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

constexpr uint32_t kRate = 48000;
constexpr double kStepS = 0.02;

constexpr auto kNothing = [](size_t, size_t, ContactIntake&) {};
constexpr auto kStrike = [](size_t, size_t, ContactIntake& it) { it.Strike(SmallImpulse(1)); };

/// What strikes in step k in an environment.
using Strikes = std::function<std::vector<ObjectImpulse>(size_t environment, int step)>;

/// One strike in each of these steps.
Strikes StrikesIn(const std::vector<int>& steps) {
  return [steps](size_t, int step) {
    return std::vector(static_cast<size_t>(std::ranges::count(steps, step)), SmallImpulse(1));
  };
}

/// Environment i strikes as environment i % 7.
std::vector<ObjectImpulse> ImpulsesOf(size_t environment, int step) {
  const size_t kind = environment % 7;
  if ((step + static_cast<int>(kind)) % 3 != 0) return {};
  ObjectImpulse lasting = SmallImpulse(1, 0.1 + 0.01 * static_cast<double>(kind), 0.0013);
  lasting.contact.impulse.duration_s = 0.001;
  return {SmallImpulse(2, 0.2), lasting};
}

class PerformanceTest : public testing::Test {
 protected:
  std::unique_ptr<Performance> Make(const EnvironmentSettings& settings, size_t environment_count,
                                    size_t thread_count = 1) {
    auto performance = *Performance::Make(settings, environment_count, thread_count, bodies_);
    for (size_t i = 0; i < environment_count; ++i) Fill(performance->environment(i));
    return performance;
  }

  /// An environment with object 1 alone.
  std::unique_ptr<Performance> MakeWithOne(const EnvironmentSettings& settings,
                                           const Vector3& position_m) {
    auto performance = *Performance::Make(settings, 1, 1, bodies_);
    ObjectProperties properties = SmallProperties();
    properties.pose = Pose{.position_m = position_m};
    EXPECT_TRUE(performance->environment(0).AddObject(1, model_, properties).ok());
    return performance;
  }

  /// Adds the two objects to an environment or a renderer.
  template <typename Target>
  void Fill(Target& target) {
    ObjectProperties larger = SmallProperties();
    larger.material.size = 1.7;
    larger.pose = Pose{.position_m = {0.5, 0, 0}};
    ASSERT_TRUE(target.AddObject(1, model_, SmallProperties()).ok());
    ASSERT_TRUE(target.AddObject(2, model_, larger).ok());
  }

  /// Returns the sound of each environment, [channel][frame] of one step after the other.
  static std::vector<std::vector<float>> Perform(Performance& performance, int step_count,
                                                 const Strikes& strikes = ImpulsesOf,
                                                 double scale = 1) {
    const size_t count = performance.environment_count();
    std::vector<std::vector<float>> sounds(count);
    for (int step = 1; step <= step_count; ++step) {
      const auto samples = performance.Step(
          [&](size_t environment, size_t, ContactIntake& intake) {
            intake.Strike(strikes(environment, step));
          },
          scale);
      const size_t size = samples.size() / count;
      for (size_t i = 0; i < count; ++i) {
        const auto own = samples.subspan(i * size, size);
        sounds[i].insert(sounds[i].end(), own.begin(), own.end());
      }
    }
    return sounds;
  }

  BodyCache bodies_;
  std::shared_ptr<const ModalModel> model_ = SmallModel();
};

EnvironmentSettings SettingsWith(double latency_s, const Microphone& microphone = {}) {
  return {.sample_rate_hz = kRate,
          .step_s = kStepS,
          .latency_s = latency_s,
          .microphones = {microphone},
          .hearing = {.distance_gain = true, .reference_distance_m = 0.1}};
}

TEST_F(PerformanceTest, IsBitForBitTheSameForAnyNumberOfEnvironmentsAndThreads) {
  for (const double latency_s : {0.0, 0.05}) {
    const auto settings = SettingsWith(latency_s, {.pose = {.position_m = {0, 1, 0}}});
    const auto seven = Perform(*Make(settings, 7), 30);
    EXPECT_GT(Peak(seven[0]), 0.1);
    EXPECT_NE(seven[0], seven[1]);
    EXPECT_EQ(Perform(*Make(settings, 1), 30)[0], seven[0]);
    for (const size_t thread_count : {1U, 2U, 4U}) {
      const auto many = Perform(*Make(settings, 64, thread_count), 30);
      for (size_t i = 0; i < many.size(); ++i) EXPECT_EQ(many[i], seven[i % 7]) << i;
    }
  }
}

/// The scale of time of step k: slow motion, a pause and fast forward.
double ScaleOf(int step) {
  constexpr std::array<double, 6> kScales{1, 0.25, 0.3, 0, 4, 1};
  return kScales[static_cast<size_t>(step / 5)];
}

TEST_F(PerformanceTest, IsBitForBitAnOfflineRenderingThoughTheScaleOfTimeChanges) {
  constexpr int kSteps = 29;
  auto settings = SettingsWith(0.05, {.pose = {.position_m = {0, 1, 0}}});
  settings.full_scale_pa = 200;
  const auto performance = Make(settings, 1);
  const auto offline = *OfflineRenderer::Make(
      {.sample_rate_hz = kRate,
       .tail_s = 1,
       .gain = 10,
       .full_scale_pa = settings.full_scale_pa,
       .step_s = kStepS,
       .space = {.hearing = settings.hearing, .listener = settings.microphones[0].pose},
       .mapping = {.delay_s = settings.latency_s}},
      bodies_);
  Fill(offline->forward());
  std::vector<float> performed;
  double time_s = 0, frames = 0;
  for (int step = 1; step <= kSteps; ++step) {
    const double scale = ScaleOf(step);
    ASSERT_TRUE(performance->CheckScale(scale).ok());
    const auto samples = performance->Step(
        [&](size_t, size_t, ContactIntake& intake) { intake.Strike(ImpulsesOf(0, step)); }, scale);
    performed.insert(performed.end(), samples.begin(), samples.end());
    frames += 960 / (scale > 0 ? scale : 1);
    EXPECT_NEAR(static_cast<double>(performed.size()), frames, 0.51) << step;
    if (scale > 0) time_s = (step - (step < 20 ? 0 : 5)) * kStepS;
    ASSERT_TRUE(offline->intake().BeginStep(time_s, scale).ok());
    offline->intake().Strike(ImpulsesOf(0, step));
    offline->intake().EndStep();
  }
  offline->forward().Finish();
  std::vector<float> rendered((performed.size() + 127) / 128 * 128);
  ASSERT_EQ(offline->Render(rendered), rendered.size());
  rendered.resize(performed.size());
  EXPECT_GT(Peak(performed), 1e-4);
  EXPECT_EQ(performed, rendered);
  EXPECT_EQ(offline->summary().limited_frame_count, 0U);
  EXPECT_EQ(ReasonOf(performance->CheckScale(0.01)), "INVALID_STREAM");
  EXPECT_EQ(ReasonOf(performance->CheckScale(-1)), "INVALID_STREAM");
}

TEST_F(PerformanceTest, SlowMotionSpreadsImpactsWhichSoundAsEver) {
  const auto hear = [&](double scale) {
    return Perform(*Make(SettingsWith(0), 1), 12, StrikesIn({1, 10}), scale)[0];
  };
  const std::vector<float> usual = hear(1), slow = hear(0.25);
  ASSERT_EQ(slow.size(), 4 * usual.size());
  const auto largest = [](const std::vector<float>& sound, size_t frame) {
    return Peak(std::span(sound).subspan(frame, 960));
  };
  // Each impact is as loud as ever, and comes four times as late.
  EXPECT_EQ(Peak(std::span(slow).first(4 * 960)), 0);
  EXPECT_NEAR(largest(slow, 4 * 960) / largest(usual, 960), 1, 0.01);
  EXPECT_GT(largest(slow, 4 * 9600), 10 * largest(slow, 4 * 9600 - 960));
}

/// Step k is heard from its end on.
TEST_F(PerformanceTest, AContactSoundsFromTheEndOfItsStepPlusTheLatency) {
  for (const double latency_s : {0.0, 0.001, 0.05}) {
    const auto performance = Make(SettingsWith(latency_s), 1);
    const auto latency_frames = static_cast<size_t>(std::llround(latency_s * kRate));
    EXPECT_EQ(performance->latency_frames(), latency_frames);
    const std::vector<float> sound = Perform(*performance, 5, StrikesIn({1}))[0];
    EXPECT_EQ(sound.size(), 5 * 960U);
    const size_t due = 960 + latency_frames;
    EXPECT_GE(Onset(sound), due);
    // sin(0) is silent, and the voice is a block late.
    EXPECT_LE(Onset(sound), due + 1 + TimingOf(SettingsWith(latency_s)).block_frame_count);
  }
}

/// 1/90 s at 48 kHz is 533 1/3 frames.
TEST_F(PerformanceTest, StepsThatAreNoWholeNumberOfFramesDoNotDrift) {
  EnvironmentSettings settings = SettingsWith(0);
  settings.step_s = 1.0 / 90;
  const auto performance = Make(settings, 2);
  EXPECT_EQ(performance->latency_frames(), 16U);
  std::vector<size_t> counts;
  for (int step = 0; step < 90; ++step) {
    performance->Step(kNothing);
    counts.push_back(performance->frame_count());
  }
  EXPECT_EQ(std::vector<size_t>(counts.begin(), counts.begin() + 4),
            (std::vector<size_t>{533, 534, 533, 533}));
  EXPECT_EQ(std::reduce(counts.begin(), counts.end()), 48000U);
}

TEST_F(PerformanceTest, AResetIsSilenceAtOnceAndThenTheSoundOfANewEnvironment) {
  const auto settings = SettingsWith(0, {.pose = {.position_m = {0, 1, 0}}});
  const auto performance = Make(settings, 2);
  const auto before = Perform(*performance, 10);
  EXPECT_NE(before[1].back(), 0);
  ASSERT_TRUE(performance->environment(1).Reset().ok());
  const auto after = Perform(*performance, 10);
  EXPECT_EQ(Peak(std::span(after[1]).first(960)), 0);
  const auto anew = Perform(*Make(settings, 2), 20);
  EXPECT_EQ(after[1], std::vector<float>(anew[1].begin(), anew[1].begin() + 9600));
  EXPECT_EQ(after[0].size(), 9600U);
  EXPECT_NE(after[0].front(), 0);  // the other environment rings on
}

TEST_F(PerformanceTest, LevelsFallWithTheDistance) {
  const auto peak_at = [&](double distance_m) {
    return Peak(
        Perform(*Make(SettingsWith(0, {.pose = {.position_m = {0, distance_m, 0}}}), 1), 20)[0]);
  };
  // Object 2 lies 0.5 m aside.
  const double near = peak_at(5), far = peak_at(10);
  EXPECT_NEAR(near / far, 2, 0.01);
}

TEST_F(PerformanceTest, AMicrophoneMovesWithTheObjectThatCarriesIt) {
  const auto fixed = Make(SettingsWith(0, {.pose = {.position_m = {3, 2, 0}}}), 1);
  auto carried_settings = SettingsWith(0, {.pose = {.position_m = {2, 0, 0}}, .object = 3});
  const auto carried = Make(carried_settings, 1);
  ObjectProperties body = SmallProperties();
  // Turned by 90 degrees about z, so that its x axis is the scene's y axis.
  body.pose = Pose{.position_m = {3, 0, 0}, .orientation = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}};
  ASSERT_TRUE(carried->environment(0).AddObject(3, model_, body).ok());
  // The microphone jumps in the first step.
  fixed->Step(kNothing);
  carried->Step(kNothing);
  const std::vector<float> a = Perform(*fixed, 20)[0], b = Perform(*carried, 20)[0];
  ASSERT_EQ(a.size(), b.size());
  EXPECT_LT(LargestDifference(a, b), 1e-5 * Peak(a));
}

TEST_F(PerformanceTest, AmbisonicsHearTheDirectionAndThePressure) {
  // Object 1 alone at the left of a microphone that looks along -z.
  const Microphone ambisonic{.kind = MicrophoneKind::kAmbisonic, .ambisonic_order = 3};
  const auto performance = MakeWithOne(SettingsWith(0, ambisonic), {-2, 0, 0});
  EXPECT_EQ(performance->channel_count(), 16U);
  const auto samples = performance->Step(kNothing);
  EXPECT_EQ(samples.size(), 16 * 960U);
  performance->Step(kStrike);
  const auto sound = performance->Step(kNothing);
  const auto channel = [&](size_t c) { return sound.subspan(c * 960, 960); };
  const double w = Peak(channel(0));
  ASSERT_GT(w, 0);
  EXPECT_TRUE(std::ranges::equal(channel(1), channel(0)));  // y is the left
  EXPECT_EQ(Peak(channel(2)), 0);
  EXPECT_EQ(Peak(channel(3)), 0);
  EXPECT_FLOAT_EQ(static_cast<float>(Peak(channel(6))), static_cast<float>(w / 2));
  EXPECT_NEAR(Peak(channel(8)), std::sqrt(0.75) * w, 1e-6 * w);
  EXPECT_NEAR(Peak(channel(9)), std::sqrt(5.0 / 8) * w, 1e-6 * w);
}

TEST_F(PerformanceTest, EarsHearTheNearerSideLouder) {
  auto settings = SettingsWith(0, {.kind = MicrophoneKind::kEars});
  settings.head = std::make_shared<const Head>(SphereHead::Make());
  const auto performance = MakeWithOne(settings, {2, 0, 0});
  performance->Step(kStrike);
  const auto sound = performance->Step(kNothing);
  ASSERT_EQ(sound.size(), 2 * 960U);
  EXPECT_GT(Peak(sound.subspan(960)), Peak(sound.first(960)));
  EXPECT_GT(Peak(sound.first(960)), 0);
}

TEST_F(PerformanceTest, TellsImpactsAtTheirTimesWithoutTheLatency) {
  auto settings = SettingsWith(0.05);
  settings.tells_impacts = true;
  const auto performance = Make(settings, 2);
  const auto perform = [&](bool strikes) {
    performance->Step([&](size_t environment, size_t, ContactIntake& intake) {
      if (strikes && environment == 1) intake.Strike(SmallImpulse(2, 0.5, 0.003));
    });
  };
  perform(false);
  perform(true);
  EXPECT_TRUE(performance->environment(0).TakeImpacts().empty());
  const auto impacts = performance->environment(1).TakeImpacts();
  ASSERT_EQ(impacts.size(), 1U);
  EXPECT_EQ(impacts[0].handle, 2U);
  EXPECT_NEAR(impacts[0].time_s, 0.043, 1e-9);
  EXPECT_FLOAT_EQ(impacts[0].impulse_newton_seconds[0], 0.5F);
  EXPECT_TRUE(performance->environment(1).TakeImpacts().empty());
}

TEST_F(PerformanceTest, ARemovedObjectFallsSilentAndItsContactsAreRejected) {
  const auto performance = Make(SettingsWith(0), 1);
  performance->Step(kStrike);
  performance->Step(kNothing);
  ASSERT_TRUE(performance->environment(0).RemoveObject(1).ok());
  for (int i = 0; i < 10; ++i) performance->Step(kNothing);
  EXPECT_EQ(Peak(performance->Step(kNothing)), 0);
  performance->Step(kStrike);
  EXPECT_EQ(performance->environment(0).rejected_count(), 1U);
  EXPECT_EQ(ReasonOf(performance->environment(0).last_rejection()), "OBJECT_NOT_FOUND");
  ASSERT_TRUE(performance->environment(0).Reset().ok());
  EXPECT_EQ(performance->environment(0).rejected_count(), 1U);
}

TEST_F(PerformanceTest, MoreEventsThanFitAreRejectedAndNotLostWithoutAWord) {
  EnvironmentSettings settings = SettingsWith(0);
  settings.most_objects = 64;
  const auto performance = Make(settings, 1);
  performance->Step([](size_t, size_t, ContactIntake& intake) {
    for (int i = 0; i < 3000; ++i) intake.Strike(SmallImpulse(1, 1e-4, 1e-7 * i));
  });
  performance->Step(kNothing);
  EXPECT_GT(performance->environment(0).rejected_count(), 2000U);
  EXPECT_EQ(ReasonOf(performance->environment(0).last_rejection()), "TOO_MANY_CONTACTS");
}

TEST_F(PerformanceTest, RefusesSettingsOutOfRange) {
  EnvironmentSettings long_step = SettingsWith(0), deaf = SettingsWith(0);
  long_step.step_s = 2;
  deaf.microphones.clear();
  const std::pair<EnvironmentSettings, size_t> wrong[] = {
      {SettingsWith(0.2), 1}, {SettingsWith(0), 4097}, {long_step, 1}, {deaf, 1}};
  for (const auto& [settings, count] : wrong) {
    const absl::Status refusal = Performance::Make(settings, count, 1, bodies_).status();
    EXPECT_EQ(ReasonOf(refusal), "INVALID_SETTINGS");
  }
}

}  // namespace
}  // namespace carillon
