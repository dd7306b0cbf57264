// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/offline_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

using testing::HasSubstr;

constexpr uint32_t kRate = 48000;
constexpr size_t kFadeFrames = kRate / 100;

/// Strikes at times that are no multiple of a block, some at the same time, not all in order within
/// their step.
void StrikeAll(auto&& strike) {
  for (int step = 0; step < 20; ++step) {
    const double time_s = 0.0137 * step;
    strike(time_s, SmallImpulse(1, 0.3 + 0.01 * step, 0.005));
    strike(time_s, SmallImpulse(2, -0.2));
    strike(time_s, SmallImpulse(1, 0.1, 0.0001));
  }
}

void StrikeAt(OfflineRenderer& renderer, double time_s, const ObjectImpulse& impulse) {
  ASSERT_TRUE(renderer.intake().BeginStep(time_s).ok());
  renderer.intake().Strike(impulse);
  renderer.intake().EndStep();
}

class OfflineRendererTest : public testing::Test {
 protected:
  std::unique_ptr<OfflineRenderer> Make(double tail_s = 0, const TimeMapping& mapping = {}) {
    auto renderer = *OfflineRenderer::Make(
        {.sample_rate_hz = kRate, .tail_s = tail_s, .mapping = mapping}, bodies_);
    ObjectProperties larger = SmallProperties();
    larger.material.size = 1.7;
    EXPECT_TRUE(renderer->forward().AddObject(1, model_, SmallProperties()).ok());
    EXPECT_TRUE(renderer->forward().AddObject(2, model_, larger).ok());
    return renderer;
  }

  static std::vector<float> RenderAll(OfflineRenderer& renderer, size_t blocks_at_a_time) {
    std::vector<float> sound;
    std::vector<float> frames(blocks_at_a_time * OfflineRenderer::kBlockFrameCount);
    renderer.forward().Finish();
    while (const size_t count = renderer.Render(frames)) {
      sound.insert(sound.end(), frames.begin(), frames.begin() + static_cast<ptrdiff_t>(count));
    }
    EXPECT_EQ(renderer.summary().frame_count, sound.size());
    return sound;
  }

  BodyCache bodies_;
  std::shared_ptr<const ModalModel> model_ = SmallModel();
};

TEST_F(OfflineRendererTest, IsBitForBitTheSameHoweverOftenAndInWhateverPieces) {
  std::vector<std::vector<float>> sounds;
  for (const size_t blocks_at_a_time : {1U, 1U, 7U, 64U}) {
    const auto renderer = Make();
    StrikeAll(
        [&](double time_s, const ObjectImpulse& impulse) { StrikeAt(*renderer, time_s, impulse); });
    sounds.push_back(RenderAll(*renderer, blocks_at_a_time));
  }
  EXPECT_GT(sounds[0].size(), kRate / 2);
  for (const std::vector<float>& sound : sounds) EXPECT_EQ(sound, sounds[0]);
}

/// Long blocks begin elsewhere than in a rendering from frame 0, and contacts fall between frames.
TEST_F(OfflineRendererTest, IsBitForBitWhatTheLiveMixerRenders) {
  Mixer mixer({.sample_rate_hz = kRate, .block_frame_count = OfflineRenderer::kBlockFrameCount});
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene();
  ObjectProperties larger = SmallProperties();
  larger.material.size = 1.7;
  ASSERT_TRUE(scenes.AddObject(scene, 1, model_, SmallProperties()).ok());
  ASSERT_TRUE(scenes.AddObject(scene, 2, model_, larger).ok());
  std::vector<float> before(21 * OfflineRenderer::kBlockFrameCount);
  mixer.Render(before);
  const auto stream =
      *scenes.OpenContactStream(scene, {.step_s = 0.0137, .scheduling_delay_s = 0.0071});
  EXPECT_EQ(stream->first_frame(), std::nullopt);
  std::unique_ptr<OfflineRenderer> renderer;
  StrikeAll([&](double time_s, const ObjectImpulse& impulse) {
    ASSERT_TRUE(stream->intake().BeginStep(time_s).ok());
    stream->intake().Strike(impulse);
    stream->intake().EndStep();
    if (!renderer) renderer = Make(0.5, {.first_frame = *stream->first_frame(), .delay_s = 0.0071});
    StrikeAt(*renderer, time_s, impulse);
  });
  EXPECT_EQ(stream->first_frame(), before.size());
  std::vector<float> offline = RenderAll(*renderer, 8);
  offline.resize(offline.size() - kFadeFrames);
  std::vector<float> live((offline.size() + 127) / 128 * 128);
  mixer.Render(live);
  live.resize(offline.size());
  EXPECT_EQ(stream->counts().late_count, 0U);
  EXPECT_EQ(offline, live);
}

SceneSpace AllHeard(bool binaural) {
  static const auto head = std::make_shared<const Head>(SphereHead::Make());
  return {.hearing = {.distance_gain = true,
                      .propagation_delay = true,
                      .panning = !binaural,
                      .binaural = binaural},
          .listener = {},
          .head = binaural ? head : nullptr};
}

/// One object circles, the listener walks and turns, and is struck on the way.
void MoveAt(ContactIntake& intake, double time_s) {
  intake.Move(1, {.position_m = {3 * std::cos(2 * time_s), 0, 3 * std::sin(2 * time_s)}});
  intake.MoveListener({.position_m = {0, time_s, 0}, .orientation = Normalized({1, 0, time_s, 0})});
}

double EnergyDb(const std::vector<float>& sound) {
  double sum = 0;
  for (const float x : sound) sum += double{x} * x;
  return 10 * std::log10(sum);
}

std::vector<float> RenderPlaced(const SceneSpace& space, size_t thread_count,
                                const TimeMapping& mapping, BodyCache& bodies) {
  const auto renderer = *OfflineRenderer::Make({.sample_rate_hz = kRate,
                                                .channel_count = 2,
                                                .tail_s = 0.5,
                                                .step_s = 0.0137,
                                                .space = space,
                                                .mapping = mapping,
                                                .thread_count = thread_count},
                                               bodies);
  for (const uint32_t handle : {1U, 2U}) {
    EXPECT_TRUE(renderer->forward().AddObject(handle, SmallModel(), SmallProperties()).ok());
  }
  double last_s = -1;
  StrikeAll([&](double time_s, const ObjectImpulse& impulse) {
    EXPECT_TRUE(renderer->intake().BeginStep(time_s).ok());
    if (time_s > last_s) MoveAt(renderer->intake(), time_s);
    last_s = time_s;
    renderer->intake().Strike(impulse);
    renderer->intake().EndStep();
  });
  std::vector<float> sound(size_t{2} * 48000 * 3);
  renderer->forward().Finish();
  sound.resize(2 * (renderer->Render(sound) - kFadeFrames));
  EXPECT_EQ(renderer->summary().rejected_count, 0U);
  return sound;
}

class PlacesTest : public OfflineRendererTest, public testing::WithParamInterface<bool> {};

INSTANTIATE_TEST_SUITE_P(PannedAndByTwoEars, PlacesTest, testing::Bool());

TEST_P(PlacesTest, AreHeardBitForBitAsLiveAndForAnyNumberOfThreads) {
  const SceneSpace space = AllHeard(GetParam());
  Mixer mixer({.sample_rate_hz = kRate,
               .block_frame_count = OfflineRenderer::kBlockFrameCount,
               .channel_count = 2});
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene(space);
  for (const uint32_t handle : {1U, 2U}) {
    ASSERT_TRUE(scenes.AddObject(scene, handle, model_, SmallProperties()).ok());
  }
  std::vector<float> before(2 * 21 * OfflineRenderer::kBlockFrameCount);
  mixer.Render(before);
  const auto stream =
      *scenes.OpenContactStream(scene, {.step_s = 0.0137, .scheduling_delay_s = 0.0271});
  double last_s = -1;
  StrikeAll([&](double time_s, const ObjectImpulse& impulse) {
    ASSERT_TRUE(stream->intake().BeginStep(time_s).ok());
    if (time_s > last_s) MoveAt(stream->intake(), time_s);
    last_s = time_s;
    stream->intake().Strike(impulse);
    stream->intake().EndStep();
  });
  const TimeMapping mapping{.first_frame = *stream->first_frame(), .delay_s = 0.0271};
  const std::vector<float> offline = RenderPlaced(space, 1, mapping, bodies_);
  std::vector<float> live((offline.size() + 255) / 256 * 256);
  mixer.Render(live);
  live.resize(offline.size());
  EXPECT_GT(*std::ranges::max_element(offline), 0.0003);
  EXPECT_EQ(offline, live);
  EXPECT_EQ(RenderPlaced(space, 2, mapping, bodies_), offline);
}

/// The sound of steps that are given while others are rendered is that of all steps given first.
TEST_F(OfflineRendererTest, IsTheSameWhileItsStepsComeIn) {
  const auto whole = Make();
  const auto forward = Make();
  std::vector<float> sound, frames(16 * OfflineRenderer::kBlockFrameCount);
  size_t before_the_end = 0;
  const auto read = [&] {
    while (const size_t count = forward->Render(frames)) {
      sound.insert(sound.end(), frames.begin(), frames.begin() + static_cast<ptrdiff_t>(count));
    }
  };
  // The sound of the first contacts has long ended before the next come.
  for (const double begin_s : {0.0, 3.0, 3.4}) {
    StrikeAll([&](double time_s, const ObjectImpulse& impulse) {
      StrikeAt(*whole, begin_s + time_s, impulse);
      StrikeAt(*forward, begin_s + time_s, impulse);
      read();
    });
    before_the_end = sound.size();
  }
  EXPECT_GT(before_the_end, 3.3 * kRate);
  forward->forward().Finish();
  read();
  EXPECT_EQ(sound, RenderAll(*whole, 8));
  EXPECT_EQ(forward->summary().accepted_count, whole->summary().accepted_count);
}

TEST_F(OfflineRendererTest, KeepsTheSoundBackThatMayLieAfterItsEnd) {
  const auto renderer = Make(0.1);
  StrikeAt(*renderer, 0, SmallImpulse(1));
  ASSERT_TRUE(renderer->intake().BeginStep(2).ok());
  std::vector<float> sound(size_t{3} * kRate);
  EXPECT_EQ(renderer->Render(sound), 0.1 * kRate - kFadeFrames);
  StrikeAt(*renderer, 2, SmallImpulse(1));
  renderer->forward().Finish();
  EXPECT_EQ(renderer->Render(sound), 2 * kRate + kFadeFrames);
}

/// Steps of poses alone go on for ten minutes after a contact, and another contact follows.
TEST_F(OfflineRendererTest, TakesNoMemoryForALongSilence) {
  constexpr double kSilenceS = 600;
  auto renderer =
      *OfflineRenderer::Make({.sample_rate_hz = 8000,
                              .step_s = 0.5,
                              .space = {.hearing = {.distance_gain = true}, .listener = {}},
                              .thread_count = 1},
                             bodies_);
  ASSERT_TRUE(renderer->forward().AddObject(1, model_, SmallProperties()).ok());
  std::vector<float> frames(64 * OfflineRenderer::kBlockFrameCount);
  StrikeAt(*renderer, 0, SmallImpulse(1));
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
  StrikeAt(*renderer, kSilenceS, SmallImpulse(1));
  renderer->forward().Finish();
  while (const size_t count = renderer->Render(frames)) frame_count += count;
  EXPECT_GT(frame_count, 8000U * kSilenceS);
  EXPECT_EQ(renderer->summary().accepted_count, 2U);
}

/// A strike of 1 N s is loud enough to end at -80 dB of full scale, and the others are not.
TEST_F(OfflineRendererTest, EndsOnceAllIsBelowMinus80DbAnd60DbBelowItsPeak) {
  for (const double newton_seconds : {1.0, 0.1, 0.01}) {
    const auto renderer = Make();
    StrikeAt(*renderer, 0, SmallImpulse(1, newton_seconds));
    const std::vector<float> sound = RenderAll(*renderer, 8);
    float peak = 0;
    for (const float x : sound) peak = std::max(peak, std::abs(x));
    const float least = std::min(1e-4F, 1e-3F * peak);
    const auto last_loud =
        std::find_if(sound.rbegin(), sound.rend(), [&](float x) { return std::abs(x) > least; });
    const auto quiet_frame_count = static_cast<size_t>(last_loud - sound.rbegin());
    ASSERT_NE(last_loud, sound.rend());
    EXPECT_GE(quiet_frame_count, kRate / 4 + kFadeFrames);            // it listens for that long
    EXPECT_LT(quiet_frame_count, kRate / 4 + kFadeFrames + 2 * 128);  // and not for longer
  }
}

TEST_F(OfflineRendererTest, ATailThatIsGivenIsKeptToTheFrame) {
  for (const double tail_s : {0.1, 0.004}) {
    const auto renderer = Make(tail_s);
    StrikeAt(*renderer, 0.05, SmallImpulse(1));
    EXPECT_EQ(RenderAll(*renderer, 8).size(), std::round((0.05 + tail_s) * kRate));
  }
}

/// The gain of the last 10 ms falls as half a period of a cosine, whether the end is given or
/// found. Before them the samples are those of a longer rendering.
TEST_F(OfflineRendererTest, FadesOutAtItsEnd) {
  const auto render = [&](double tail_s, size_t blocks_at_a_time) {
    const auto renderer = Make(tail_s);
    StrikeAt(*renderer, 0, SmallImpulse(1));
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

TEST_F(OfflineRendererTest, CountsWhatSoundedAndWhatCouldNotBeUsed) {
  const auto renderer = Make();
  StrikeAt(*renderer, 0, SmallImpulse(1));
  StrikeAt(*renderer, 0, SmallImpulse(7));                // no such object
  StrikeAt(*renderer, 0, SmallImpulse(1, std::nan("")));  // no number
  EXPECT_FALSE(renderer->intake().BeginStep(-1).ok());    // before the beginning
  const std::vector<float> sound = RenderAll(*renderer, 8);
  EXPECT_EQ(renderer->summary().accepted_count, 1U);
  EXPECT_EQ(renderer->summary().rejected_count, 2U);
  EXPECT_THAT(renderer->summary().last_rejection.ToString(), HasSubstr("CONTACT_MALFORMED: "));
  float peak = 0;
  for (const float sample : sound) peak = std::max(peak, std::abs(sample));
  EXPECT_EQ(renderer->summary().peak, peak);  // the limiter did not work
  EXPECT_EQ(renderer->summary().limited_frame_count, 0U);
}

TEST_F(OfflineRendererTest, TakesMoreImpulsesAtOnceThanTheLiveMixer) {
  const auto renderer = Make();
  constexpr uint64_t kCount = 3 * kMostImpulsesPerFrame * OfflineRenderer::kBlockFrameCount;
  for (uint64_t i = 0; i < kCount; ++i) StrikeAt(*renderer, 0.001, SmallImpulse(1, 1e-4));
  RenderAll(*renderer, 8);
  EXPECT_EQ(renderer->summary().accepted_count, kCount);
  EXPECT_EQ(renderer->summary().rejected_count, 0U);
}

TEST_F(OfflineRendererTest, TellsBlowsFromItsFirstFrameAndOnTheSurface) {
  auto renderer = *OfflineRenderer::Make(
      {.mapping = {.first_frame = 1280, .first_time_s = 3, .delay_s = 0.125}, .tells_blows = true},
      bodies_);
  ObjectProperties twice = SmallProperties();
  twice.material.size = 2;
  ASSERT_TRUE(renderer->forward().AddObject(7, model_, twice).ok());
  ObjectImpulse impulse = SmallImpulse(7, 0.5);
  impulse.contact.impulse.location = SurfacePoint{.triangle = 0, .weights = {0, 0.5, 0.5}};
  StrikeAt(*renderer, 3.5, impulse);
  impulse.contact.handle = 8;  // is rejected
  StrikeAt(*renderer, 3.6, impulse);
  RenderAll(*renderer, 8);
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

TEST_F(OfflineRendererTest, AnImpactInOneStepSoundsAsLoudAsOneThatAnEngineSpreadsOverMoreSteps) {
  double one_step_db = 0;
  for (const int step_count : {1, 2, 5, 8}) {
    const auto renderer = *OfflineRenderer::Make(
        {.sample_rate_hz = kRate, .tail_s = 0.5, .step_s = 1.0 / 60}, bodies_);
    ASSERT_TRUE(renderer->forward().AddObject(1, model_, SmallProperties()).ok());
    for (int step = 0; step < 20; ++step) {
      ASSERT_TRUE(renderer->intake().BeginStep(step / 60.0).ok());
      if (step >= 1 && step <= step_count) {
        renderer->intake().Touch({.contact = SmallImpulse(1, 1.0 / step_count).contact});
      }
      renderer->intake().EndStep();
    }
    const double energy_db = EnergyDb(RenderAll(*renderer, 8));
    if (step_count == 1) one_step_db = energy_db;
    EXPECT_NEAR(energy_db, one_step_db, 0.1) << step_count;
  }
}

}  // namespace
}  // namespace carillon
