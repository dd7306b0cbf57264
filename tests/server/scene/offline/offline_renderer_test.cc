// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/offline_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/server/scene/transfer_stage.h"
#include "tests/server/synthesis/sound.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

constexpr uint32_t kRate = 48000;
constexpr size_t kFadeFrames = kRate / 100;

/// Strikes at times that are no multiple of a block, some at the same time, not all in order within
/// their step. One object circles and turns, and the listener walks and turns.
void Simulate(
    ContactIntake& intake, double begin_s = 0, const std::function<void()>& after_step = [] {}) {
  for (int step = 0; step < 20; ++step) {
    const double time_s = begin_s + 0.0137 * step;
    ASSERT_TRUE(intake.BeginStep(time_s).ok());
    intake.Move(1, {.position_m = {3 * std::cos(2 * time_s), 0, 3 * std::sin(2 * time_s)},
                    .orientation = Normalized({1, 0, 2 * time_s, 0})});
    intake.MoveListener(
        {.position_m = {0, time_s, 0}, .orientation = Normalized({1, 0, time_s, 0})});
    intake.Strike(SmallImpulse(1, 0.3 + 0.01 * step, 0.005));
    intake.EndStep();
    after_step();
    StrikeAt(intake, time_s, {SmallImpulse(2, -0.2)});
    after_step();
    StrikeAt(intake, time_s, {SmallImpulse(1, 0.1, 0.0001)});
    after_step();
  }
}

ObjectProperties Larger(double size) {
  ObjectProperties properties = SmallProperties();
  properties.material.size = size;
  return properties;
}

class OfflineRendererTest : public testing::Test {
 protected:
  std::unique_ptr<OfflineRenderer> Make(const OfflineSettings& settings = {},
                                        TransferStore* transfers = nullptr) {
    auto renderer = *OfflineRenderer::Make(settings, bodies_, transfers);
    EXPECT_TRUE(renderer->forward().AddObject(1, model_, SmallProperties()).ok());
    EXPECT_TRUE(renderer->forward().AddObject(2, model_, Larger(1.7)).ok());
    return renderer;
  }

  /// Appends what is ready to `sound`.
  static void RenderReady(OfflineRenderer& renderer, std::vector<float>& sound,
                          size_t blocks_at_a_time, size_t channel_count = 1) {
    const size_t block = OfflineRenderer::kBlockFrameCount * channel_count;
    std::vector<float> frames(blocks_at_a_time * block);
    while (const size_t count = channel_count * renderer.Render(frames)) {
      sound.insert(sound.end(), frames.begin(), frames.begin() + static_cast<ptrdiff_t>(count));
    }
  }

  static std::vector<float> RenderAll(OfflineRenderer& renderer, size_t blocks_at_a_time = 8,
                                      size_t channel_count = 1) {
    std::vector<float> sound;
    renderer.forward().Finish();
    RenderReady(renderer, sound, blocks_at_a_time, channel_count);
    EXPECT_EQ(channel_count * renderer.summary().frame_count, sound.size());
    return sound;
  }

  BodyCache bodies_;
  std::shared_ptr<const ModalModel> model_ = SmallModel();
};

struct Hall {
  std::string name;
  uint32_t channel_count = 1;
  HearingSettings hearing{};
};

class HallTest : public OfflineRendererTest, public testing::WithParamInterface<Hall> {};

INSTANTIATE_TEST_SUITE_P(
    Halls, HallTest,
    testing::Values(
        Hall{.name = "None"},
        Hall{"Panned", 2, {.distance_gain = true, .propagation_delay = true, .panning = true}},
        Hall{"TwoEars", 2, {.distance_gain = true, .propagation_delay = true, .binaural = true}},
        Hall{"Directed",
             1,
             {.distance_gain = true,
              .propagation_delay = true,
              .directivity = true,
              .near_field = true}}),
    [](const auto& hall) { return hall.param.name; });

/// Long blocks begin elsewhere than in a rendering from frame 0, and contacts fall between frames.
TEST_P(HallTest, IsHeardBitForBitAsLiveAndForAnyNumberOfThreads) {
  const auto& [name, channel_count, hearing] = GetParam();
  SceneSpace space{.hearing = hearing, .listener = {}};
  if (hearing.binaural) space.head = std::make_shared<const Head>(SphereHead::Make());
  TransferStage stage(space, {.channel_count = channel_count});
  // All modes are dipoles along z.
  if (hearing.directivity) stage.Store({.power_integrals = {1, 1, 1}, .harmonics = {2, 2, 2}});
  stage.Add();
  stage.Add(Larger(1.7));
  model_ = stage.model;
  stage.Render(21);
  const auto stream = *stage.scenes.OpenContactStream(
      stage.scene, {.step_s = 0.0137, .scheduling_delay_s = 0.0271});
  EXPECT_EQ(stream->first_frame(), std::nullopt);
  Simulate(stream->intake());
  EXPECT_EQ(stream->first_frame(), size_t{21} * 128);
  std::vector<float> live = stage.Render(1000);
  EXPECT_GT(Peak(live), 0.0003);
  EXPECT_EQ(stream->counts().late_count, 0U);
  for (const size_t thread_count : {1U, 2U}) {
    const auto renderer =
        Make({.channel_count = channel_count,
              .tail_s = 0.5,
              .step_s = 0.0137,
              .space = space,
              .mapping = {.first_frame = *stream->first_frame(), .delay_s = 0.0271},
              .thread_count = thread_count},
             &stage.database->transfers());
    Simulate(renderer->intake());
    std::vector<float> offline = RenderAll(*renderer, 8, channel_count);
    offline.resize(offline.size() - channel_count * kFadeFrames);
    EXPECT_EQ(renderer->summary().rejected_count, 0U);
    ASSERT_GE(live.size(), offline.size());
    live.resize(offline.size());
    EXPECT_EQ(offline, live);
  }
}

/// The sound of steps that are given while others are rendered is that of all steps given first.
TEST_F(OfflineRendererTest, IsTheSameWhileItsStepsComeIn) {
  const auto whole = Make();
  const auto forward = Make();
  std::vector<float> sound;
  size_t before_the_end = 0;
  // The sound of the first contacts has long ended before the next come.
  for (const double begin_s : {0.0, 3.0, 3.4}) {
    Simulate(whole->intake(), begin_s);
    Simulate(forward->intake(), begin_s, [&] { RenderReady(*forward, sound, 7); });
    before_the_end = sound.size();
  }
  EXPECT_GT(before_the_end, 3.3 * kRate);
  forward->forward().Finish();
  RenderReady(*forward, sound, 7);
  EXPECT_EQ(sound, RenderAll(*whole, 64));
  EXPECT_EQ(forward->summary().accepted_count, whole->summary().accepted_count);
}

TEST_F(OfflineRendererTest, KeepsTheSoundBackThatMayLieAfterItsEnd) {
  const auto renderer = Make({.tail_s = 0.1});
  StrikeAt(renderer->intake(), 0, {SmallImpulse(1)});
  ASSERT_TRUE(renderer->intake().BeginStep(2).ok());
  std::vector<float> sound(size_t{3} * kRate);
  EXPECT_EQ(renderer->Render(sound), 0.1 * kRate - kFadeFrames);
  StrikeAt(renderer->intake(), 2, {SmallImpulse(1)});
  renderer->forward().Finish();
  EXPECT_EQ(renderer->Render(sound), 2 * kRate + kFadeFrames);
}

/// Steps of poses alone go on for ten minutes after a contact, and another contact follows.
TEST_F(OfflineRendererTest, TakesNoMemoryForALongSilence) {
  constexpr double kSilenceS = 600;
  const auto renderer = Make({.sample_rate_hz = 8000,
                              .step_s = 0.5,
                              .space = {.hearing = {.distance_gain = true}, .listener = {}},
                              .thread_count = 1});
  std::vector<float> frames(64 * OfflineRenderer::kBlockFrameCount);
  StrikeAt(renderer->intake(), 0, {SmallImpulse(1)});
  size_t frame_count = 0, most_bytes = 0;
  for (double time_s = 0.5; time_s < kSilenceS; time_s += 0.5) {
    ASSERT_TRUE(renderer->intake().BeginStep(time_s).ok());
    renderer->intake().Move(1, {.position_m = {std::sin(time_s), 1, 0}});
    renderer->intake().EndStep();
    while (const size_t count = renderer->Render(frames)) frame_count += count;
    most_bytes = std::max(most_bytes, renderer->held_bytes() + renderer->forward().waiting_bytes());
  }
  EXPECT_LT(frame_count, 8000U * 10);  // until the first contact is silent
  EXPECT_LT(most_bytes, size_t{1} << 20U);
  StrikeAt(renderer->intake(), kSilenceS, {SmallImpulse(1)});
  renderer->forward().Finish();
  while (const size_t count = renderer->Render(frames)) frame_count += count;
  EXPECT_GT(frame_count, 8000U * kSilenceS);
  EXPECT_EQ(renderer->summary().accepted_count, 2U);
}

/// A strike of 1 N s is loud enough to end at -80 dB of full scale, and the others are not.
TEST_F(OfflineRendererTest, EndsOnceAllIsBelowMinus80DbAnd60DbBelowItsPeak) {
  for (const double newton_seconds : {1.0, 0.1, 0.01}) {
    const auto renderer = Make();
    StrikeAt(renderer->intake(), 0, {SmallImpulse(1, newton_seconds)});
    const std::vector<float> sound = RenderAll(*renderer);
    const double least = std::min(1e-4, 1e-3 * Peak(sound));
    const auto last_loud =
        std::find_if(sound.rbegin(), sound.rend(), [&](float x) { return std::abs(x) > least; });
    const auto quiet_frame_count = static_cast<size_t>(last_loud - sound.rbegin());
    ASSERT_NE(last_loud, sound.rend());
    EXPECT_GE(quiet_frame_count, kRate / 4 + kFadeFrames);            // it listens for that long
    EXPECT_LT(quiet_frame_count, kRate / 4 + kFadeFrames + 2 * 128);  // and not for longer
    EXPECT_EQ(renderer->summary().peak, Peak(sound));                 // the limiter did not work
    EXPECT_EQ(renderer->summary().limited_frame_count, 0U);
  }
}

TEST_F(OfflineRendererTest, ATailThatIsGivenIsKeptToTheFrame) {
  for (const double tail_s : {0.1, 0.004}) {
    const auto renderer = Make({.tail_s = tail_s});
    StrikeAt(renderer->intake(), 0.05, {SmallImpulse(1)});
    EXPECT_EQ(RenderAll(*renderer).size(), std::round((0.05 + tail_s) * kRate));
  }
}

/// The gain of the last 10 ms falls as half a period of a cosine, whether the end is given or
/// found. Before them the samples are those of a longer rendering.
TEST_F(OfflineRendererTest, FadesOutAtItsEnd) {
  const auto render = [&](double tail_s, size_t blocks_at_a_time) {
    const auto renderer = Make({.tail_s = tail_s});
    StrikeAt(renderer->intake(), 0, {SmallImpulse(1)});
    return RenderAll(*renderer, blocks_at_a_time);
  };
  const std::vector<float> longer = render(4, 64);
  for (const double tail_s : {0.0, 0.1}) {
    const std::vector<float> sound = render(tail_s, 1);
    ASSERT_LT(sound.size(), longer.size());
    for (size_t i = 0; i < sound.size(); ++i) {
      const size_t left = std::min(sound.size() - i, kFadeFrames);
      const double phase = M_PI * static_cast<double>(kFadeFrames - left) / kFadeFrames;
      ASSERT_EQ(sound[i], longer[i] * static_cast<float>(0.5 + 0.5 * std::cos(phase))) << i;
    }
  }
}

TEST_F(OfflineRendererTest, TakesMoreImpulsesAtOnceThanTheLiveMixer) {
  const auto renderer = Make();
  constexpr uint64_t kCount = 3 * kMostImpulsesPerFrame * OfflineRenderer::kBlockFrameCount;
  for (uint64_t i = 0; i < kCount; ++i)
    StrikeAt(renderer->intake(), 0.001, {SmallImpulse(1, 1e-4)});
  RenderAll(*renderer);
  EXPECT_EQ(renderer->summary().accepted_count, kCount);
  EXPECT_EQ(renderer->summary().rejected_count, 0U);
}

TEST_F(OfflineRendererTest, TellsBlowsFromItsFirstFrameAndOnTheSurface) {
  const auto renderer = Make(
      {.mapping = {.first_frame = 1280, .first_time_s = 3, .delay_s = 0.125}, .tells_blows = true});
  ASSERT_TRUE(renderer->forward().AddObject(7, model_, Larger(2)).ok());
  ObjectImpulse impulse = SmallImpulse(7, 0.5);
  impulse.contact.impulse.location = SurfacePoint{.triangle = 0, .weights = {0, 0.5, 0.5}};
  StrikeAt(renderer->intake(), 3.5, {impulse});
  impulse.contact.handle = 8;  // is rejected
  StrikeAt(renderer->intake(), 3.6, {impulse});
  RenderAll(*renderer);
  const std::vector<BlowRecord> blows = renderer->forward().TakeBlows();
  ASSERT_EQ(blows.size(), 1U);
  const BlowRecord& blow = blows.front();
  EXPECT_NEAR(blow.time_s, 0.625, 1e-9);
  EXPECT_EQ(blow.handle, 7U);
  EXPECT_FALSE(blow.by.has_value());
  EXPECT_NEAR(blow.point_m[0], 0.1, 1e-6);
  EXPECT_NEAR(blow.point_m[1], 0.1, 1e-6);
  EXPECT_FLOAT_EQ(blow.impulse_newton_seconds[0], 0.5F);
}

}  // namespace
}  // namespace carillon
