// SPDX-License-Identifier: Apache-2.0
// Banks that are heard through voices, on a mixer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/server/synthesis/bank/struck_ball.h"
#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

const SoundingMode kMode = MakeMode(0, 440, -30, 20);
constexpr HearingSettings kAll{
    .distance_gain = true, .propagation_delay = true, .panning = true, .sound_speed_m_per_s = 343};

std::shared_ptr<Voice> MakeVoice(const Place& object, const HearingSettings& hearing = kAll,
                                 size_t channel_count = 2) {
  return std::make_shared<Voice>(
      Voice::Settings{.hearing = hearing, .channel_count = channel_count}, object, Place());
}

TEST(PlacedBanks, WithoutVoicesBothChannelsAreTheMonoMixBitForBit) {
  Mixer mono, stereo({.channel_count = 2});
  for (Mixer* mixer : {&mono, &stereo}) {
    Strike(*mixer->OpenStream().value(), mixer->Add(MakeBank({kMode})).value(), 77);
  }
  std::vector<float> both;
  for (const float sample : Render(mono, 64)) both.insert(both.end(), 2, sample);
  EXPECT_EQ(Render(stereo, 64), both);
}

TEST(PlacedBanks, AStrikeIsHeardFromItsPlaceThroughLongBlocksAndBeyond) {
  Mixer mixer({.channel_count = 2});
  // 1000 frames away, to the right.
  const double distance_m = 1000 * 343 * kTestFrameS;
  const BankId bank =
      mixer.Add(MakeBank({kMode}), MakeVoice({.position_m = {distance_m, 0, 0}})).value();
  Strike(*mixer.OpenStream().value(), bank, 300);
  const std::vector<float> frames = Render(mixer, 100);
  const double gain = std::numbers::sqrt2 / distance_m;
  for (size_t n = 0; n < frames.size() / 2; ++n) {
    EXPECT_NEAR(frames[2 * n], 0, 1e-6) << n;
    EXPECT_NEAR(frames[2 * n + 1], gain * SumOfStrikes({.modes = {kMode}}, {1300}, n), 1e-6) << n;
  }
}

TEST(PlacedBanks, ABankLetRingOutIsHeardUntilItsSoundHasArrived) {
  Mixer mixer;
  const BankId bank =
      mixer.Add(MakeBank({kMode}), MakeVoice({.position_m = {0, 0, 170}}, kAll, 1)).value();
  Strike(*mixer.OpenStream().value(), bank, 0);
  Render(mixer, 1);
  mixer.LetRingOut(bank);
  const std::vector<float> frames = Render(mixer, 400);
  const double arrived = 170 / (343 * kTestFrameS);  // after 0.5 s
  for (size_t n = 0; n < frames.size(); ++n) {
    // It arrives between two samples: its first ones are what is left of it below Nyquist.
    const bool first = std::abs(static_cast<double>(n + 128) - arrived) < 12;
    EXPECT_NEAR(frames[n], SumOfStrikes({.modes = {kMode}}, {arrived}, n + 128) / 170,
                first ? 5e-6 : 1e-6)
        << n;
  }
  Render(mixer, 2000);
  EXPECT_EQ(mixer.statistics().bank_count, 0U);
}

TEST(PlacedBanks, ABankFadedOutDoesNotJump) {
  Mixer mixer;
  const BankId bank =
      mixer.Add(MakeBank({kMode}), MakeVoice({.position_m = {0, 0, 2}}, kAll, 1)).value();
  Strike(*mixer.OpenStream().value(), bank, 0);
  Render(mixer, 10);
  mixer.FadeOut(bank);
  const std::vector<float> frames = Render(mixer, 400);
  float before = frames[0];
  for (const float sample : frames) {
    EXPECT_LT(std::abs(sample - before), 0.06 * 0.1);  // the steepest slope of the tone at 0.1
    before = sample;
  }
  EXPECT_EQ(frames.back(), 0);
  EXPECT_EQ(mixer.statistics().bank_count, 0U);
}

TEST(PlacedBanks, AnotherBankOnTheSameVoiceTakesOverWhileTheFirstRings) {
  Mixer mixer;
  const auto voice = MakeVoice({.position_m = {0, 0, 1}}, {.distance_gain = true}, 1);
  const BankId first = mixer.Add(MakeBank({kMode}), voice).value();
  const auto stream = mixer.OpenStream().value();
  Strike(*stream, first, 0);
  Render(mixer, 4);
  const BankId second = mixer.Add(MakeBank({kMode}), voice).value();
  mixer.LetRingOut(first);
  Strike(*stream, second, 600);
  ExpectStrikes(Render(mixer, 60), kMode, 512, {0, 600});
  Render(mixer, 1000);
  EXPECT_EQ(mixer.statistics().bank_count, 1U);
}

/// Sixty objects with impulses, most of which move, rendered by `thread_count` threads.
std::vector<float> RenderCrowd(size_t thread_count, size_t blocks_a_call) {
  RenderThreads threads(thread_count);
  Mixer mixer({.channel_count = 2, .threads = &threads});
  const auto stream = mixer.OpenStream(65536).value();
  for (uint32_t i = 0; i < 60; ++i) {
    std::vector<SoundingMode> modes;
    modes.reserve(150);
    for (uint32_t m = 0; m < 150; ++m) {
      modes.push_back(MakeMode(m, 60 + 97 * m + i, -1 - 0.3 * (m * 7 % 150)));
    }
    const bool moves = i % 4 != 0;
    const Place place{.position_m = {i - 10.0, 0.1 * i, -1.0 - i}};
    const BankId bank =
        mixer.Add(MakeBank(modes, 1e-2F), moves ? MakeVoice(place) : nullptr).value();
    for (uint64_t k = 0; k < 40; ++k) {
      Strike(*stream, bank, 317 * k + i, 0.4F);
      if (!moves) continue;
      const Motion motion{.position_m = {static_cast<float>(k) * 0.2F, 1, -2},
                          .glide_frames = k % 7 == 6 ? 0.0F : 800.0F};
      MixerEvent event{.bank = bank, .frame = 800 * k, .action = ObjectMove{motion}};
      if (k % 10 == 9) event.action = ListenerMove{motion};
      stream->TryPush(event);
    }
  }
  return Render(mixer, 256, blocks_a_call);
}

TEST(PlacedBanks, TheSoundIsTheSameBitForBitFromRunToRunForAnyNumberOfThreadsAndBlocksACall) {
  const std::vector<float> alone = RenderCrowd(1, 1);
  EXPECT_GT(*std::ranges::max_element(alone), 0.001);
  for (const size_t thread_count : {1U, 2U, 3U, 7U}) {
    EXPECT_EQ(RenderCrowd(thread_count, 16), alone) << thread_count;
  }
}

TEST(PlacedBanks, AMoveOfABankWithoutAVoiceIsDropped) {
  Mixer mixer;
  const BankId bank = mixer.Add(MakeBank({kMode})).value();
  mixer.OpenStream().value()->TryPush({.bank = bank, .action = ObjectMove{}});
  Render(mixer, 1);
  EXPECT_EQ(mixer.statistics().dropped_count, 1U);
}

// Banks on a mixer that sound by the acceleration of their bodies, too.

constexpr double kPi = std::numbers::pi;
constexpr double kHz = 2345, kSigma = -200, kCoupling = 500;

/// A raised cosine with its middle at `middle_frame`.
auto RaisedCosine(double middle_frame, double duration_s) {
  return [=](double t) {
    const double since = t - middle_frame * kTestFrameS;
    if (std::abs(since) > duration_s / 2) return 0.0;
    return (1 + std::cos(2 * kPi * since / duration_s)) / duration_s;
  };
}

/// One bank of one mode on a mixer.
class Scene {
 public:
  explicit Scene(bool moves, const MixerSettings& settings = {}) : mixer_(settings) {
    OscillatorBankSettings bank;
    if (moves) bank.moved = MakeBall();
    const SoundingModes modes{.modes = {MakeMode(0, kHz, kSigma, kCoupling)}};
    bank_ = mixer_.Add(std::make_unique<OscillatorBank>(modes, MakeUniformShapes(1), bank)).value();
  }

  void Strike(double frame, double duration_s) {
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.pulse = Pulse::RaisedCosine(static_cast<float>(duration_s));
    MixerEvent event{.bank = bank_, .action = impulse};
    event.SetTime(frame);
    stream_->TryPush(event);
  }

  std::vector<float> Render(size_t block_count) {
    return carillon::Render(mixer_, block_count, block_count);
  }

  Mixer& mixer() { return mixer_; }

 private:
  Mixer mixer_;
  BankId bank_{};
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(64).value();
};

/// What the acceleration adds to the sound of a blow.
std::vector<double> ClickOf(double frame, double duration_s, size_t block_count) {
  Scene moving(true), still(false);
  moving.Strike(frame, duration_s);
  still.Strike(frame, duration_s);
  const auto with = moving.Render(block_count), without = still.Render(block_count);
  std::vector<double> click;
  for (size_t n = 0; n < with.size(); ++n) click.push_back(double{with[n]} - without[n]);
  return click;
}

// Blocks have 128 frames: the contact around frame 1030.4 begins in the block before its middle.
TEST(AcceleratedBanks, ABallFollowsTheForceThatItsModesFollow) {
  for (const double duration_s : {1e-4, 1e-3, 9e-3}) {
    for (const double frame : {1024.0, 1030.4}) {
      const std::vector<double> click = ClickOf(frame, duration_s, 16);
      // The ball's pressure at 1 m, the mean over all directions.
      const double scale = kBallAirDensity * kBallRadiusM * kBallRadiusM / kFullScalePa /
                           (kBallDensity * kBallM3) / std::sqrt(3.0);
      const auto right =
          IntegrateBall(kTestSampleRateHz, click.size(), scale, RaisedCosine(frame, duration_s));
      EXPECT_LT(LargestDifference(click, right), 2e-3 * Peak(right)) << duration_s;
    }
  }
}

TEST(AcceleratedBanks, AContactThatWouldHaveBegunBeginsNow) {
  constexpr double kDuration = 1e-3;  // 48 frames
  Scene scene(true), later(true);
  scene.Strike(10, kDuration);
  later.Strike(24, kDuration);
  EXPECT_EQ(scene.Render(16), later.Render(16));
  EXPECT_EQ(scene.mixer().statistics().accepted_count, 1u);
  EXPECT_EQ(scene.mixer().statistics().late_count, 0u);
}

TEST(AcceleratedBanks, SoundTheSameHoweverManyBlocksAreRenderedTogether) {
  Scene together(true), apart(true);
  for (Scene* scene : {&together, &apart}) {
    for (const double frame : {500.0, 520.5, 1030.0}) scene->Strike(frame, 5e-3);
  }
  std::vector<float> sound;
  for (int i = 0; i < 16; ++i) {
    for (const float x : apart.Render(1)) sound.push_back(x);
  }
  EXPECT_EQ(together.Render(16), sound);
}

TEST(AcceleratedBanks, AStopSilencesContactsThatHaveNotBegun) {
  Scene scene(true);
  scene.Strike(1030, 1e-3);
  scene.Render(1);
  scene.mixer().Stop({});
  EXPECT_EQ(Peak(scene.Render(16)), 0);
}

TEST(AcceleratedBanks, AnImpulseWhoseBeginningFindsNoPlaceSoundsAndIsAccepted) {
  Scene scene(true, {.most_buses = 1, .most_pending_events = 1});
  scene.Strike(1030, 1e-3);
  EXPECT_EQ(Onset(scene.Render(16)), 1030U);
  EXPECT_EQ(scene.mixer().statistics().accepted_count, 1U);
  EXPECT_EQ(scene.mixer().statistics().dropped_count, 1U);  // the beginning
}

}  // namespace
}  // namespace carillon
