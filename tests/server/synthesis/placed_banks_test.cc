// SPDX-License-Identifier: Apache-2.0
// Banks that are heard through voices, on a mixer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr double kDt = 1 / kTestSampleRateHz;
constexpr double kFrequencyHz = 440;
constexpr double kSigma = -30;
constexpr double kCoupling = 20;
constexpr HearingSettings kAll{
    .distance_gain = true, .propagation_delay = true, .panning = true, .sound_speed_m_per_s = 343};

std::unique_ptr<OscillatorBank> MakeBank() {
  return std::make_unique<OscillatorBank>(
      SoundingModes{.modes = {MakeMode(0, kFrequencyHz, kSigma, kCoupling)}}, MakeUniformShapes(1),
      OscillatorBankSettings{});
}

/// The sound of one impulse on the bank, `frames` frames after it.
double Right(double frames) {
  return ClosedForm(MakeMode(0, kFrequencyHz, kSigma, kCoupling), 1, frames * kDt);
}

std::shared_ptr<Voice> MakeVoice(const Place& object, const HearingSettings& hearing = kAll,
                                 size_t channel_count = 2) {
  return std::make_shared<Voice>(
      Voice::Settings{.hearing = hearing, .channel_count = channel_count}, object, Place());
}

std::vector<float> Render(Mixer& mixer, size_t block_count, size_t blocks_a_call = 1) {
  const size_t block_size = 128 * mixer.settings().channel_count;
  std::vector<float> frames(block_count * block_size);
  for (size_t n = 0; n < frames.size(); n += blocks_a_call * block_size) {
    mixer.Render(std::span(frames).subspan(n, blocks_a_call * block_size));
  }
  return frames;
}

void Strike(EventStream& stream, BankId bank, uint64_t frame) {
  stream.TryPush({.bank = bank, .frame = frame, .action = MakeUnitImpulse()});
}

TEST(PlacedBanks, WithoutVoicesBothChannelsAreTheMonoMixBitForBit) {
  Mixer mono, stereo({.channel_count = 2});
  std::vector<float> mixes[2];
  for (Mixer* mixer : {&mono, &stereo}) {
    const BankId bank = mixer->Add(MakeBank()).value();
    Strike(*mixer->OpenStream().value(), bank, 77);
    mixes[mixer == &stereo ? 1 : 0] = Render(*mixer, 64);
  }
  ASSERT_EQ(mixes[1].size(), 2 * mixes[0].size());
  for (size_t n = 0; n < mixes[0].size(); ++n) {
    ASSERT_EQ(mixes[1][2 * n], mixes[0][n]) << n;
    ASSERT_EQ(mixes[1][2 * n + 1], mixes[0][n]) << n;
  }
}

TEST(PlacedBanks, AStrikeIsHeardFromItsPlaceThroughLongBlocksAndBeyond) {
  Mixer mixer({.channel_count = 2});
  // 1000 frames away, to the right.
  const double distance_m = 1000 * 343 * kDt;
  const BankId bank = mixer.Add(MakeBank(), MakeVoice({.position_m = {distance_m, 0, 0}})).value();
  Strike(*mixer.OpenStream().value(), bank, 300);
  const std::vector<float> frames = Render(mixer, 100);
  const double gain = std::numbers::sqrt2 / distance_m;
  for (size_t n = 0; n < frames.size() / 2; ++n) {
    const double since = static_cast<double>(n) - 1300;
    EXPECT_NEAR(frames[2 * n], 0, 1e-6) << n;
    EXPECT_NEAR(frames[2 * n + 1], since < 0 ? 0 : gain * Right(since), 1e-6) << n;
  }
}

TEST(PlacedBanks, ABankLetRingOutIsHeardUntilItsSoundHasArrived) {
  Mixer mixer;
  const BankId bank =
      mixer.Add(MakeBank(), MakeVoice({.position_m = {0, 0, 170}}, kAll, 1)).value();
  Strike(*mixer.OpenStream().value(), bank, 0);
  Render(mixer, 1);
  mixer.LetRingOut(bank);
  const std::vector<float> frames = Render(mixer, 400);
  const auto arrived = static_cast<double>(170 / (343 * kDt));  // after 0.5 s
  for (size_t n = 0; n < frames.size(); ++n) {
    const double since = static_cast<double>(n + 128) - arrived;
    // It arrives between two samples: its first ones are what is left of it below Nyquist.
    EXPECT_NEAR(frames[n], since < 0 ? 0 : Right(since) / 170, std::abs(since) < 12 ? 5e-6 : 1e-6)
        << n;
  }
  Render(mixer, 2000);
  EXPECT_EQ(mixer.statistics().bank_count, 0U);
}

TEST(PlacedBanks, ABankFadedOutDoesNotJump) {
  Mixer mixer;
  const BankId bank = mixer.Add(MakeBank(), MakeVoice({.position_m = {0, 0, 2}}, kAll, 1)).value();
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
  const BankId first = mixer.Add(MakeBank(), voice).value();
  const auto stream = mixer.OpenStream().value();
  Strike(*stream, first, 0);
  Render(mixer, 4);
  const BankId second = mixer.Add(MakeBank(), voice).value();
  mixer.LetRingOut(first);
  Strike(*stream, second, 600);
  const std::vector<float> frames = Render(mixer, 60);
  for (size_t n = 0; n < frames.size(); ++n) {
    const double frame = static_cast<double>(n + 512);
    EXPECT_NEAR(frames[n], Right(frame) + (frame < 600 ? 0 : Right(frame - 600)), 1e-6) << n;
  }
  Render(mixer, 1000);
  EXPECT_EQ(mixer.statistics().bank_count, 1U);
}

std::vector<float> RenderCrowd(size_t thread_count, size_t blocks_a_call) {
  RenderThreads threads(thread_count);
  Mixer mixer({.channel_count = 2, .threads = &threads});
  const auto stream = mixer.OpenStream(65536).value();
  for (int i = 0; i < 20; ++i) {
    const Place place{.position_m = {i - 10.0, 0.1 * i, -1.0 - i}};
    const BankId bank = mixer.Add(MakeBank(), i % 4 == 0 ? nullptr : MakeVoice(place)).value();
    for (uint64_t k = 0; k < 40; ++k) {
      Strike(*stream, bank, 317 * k + static_cast<uint64_t>(i));
      if (i % 4 == 0) continue;
      const Motion motion{.position_m = {static_cast<float>(k) * 0.2F, 1, -2},
                          .glide_frames = k % 7 == 6 ? 0.0F : 800.0F};
      MixerEvent event{.bank = bank, .frame = 800 * k, .action = ObjectMove{motion}};
      if (k % 10 == 9) event.action = ListenerMove{motion};
      stream->TryPush(event);
    }
  }
  return Render(mixer, 256, blocks_a_call);
}

TEST(PlacedBanks, TheSoundIsTheSameBitForBitForAnyNumberOfThreadsAndBlocksACall) {
  const std::vector<float> alone = RenderCrowd(1, 1);
  EXPECT_GT(*std::ranges::max_element(alone), 0.001);
  EXPECT_EQ(RenderCrowd(1, 16), alone);
  EXPECT_EQ(RenderCrowd(3, 16), alone);
}

TEST(PlacedBanks, AMoveOfABankWithoutAVoiceIsDropped) {
  Mixer mixer;
  const BankId bank = mixer.Add(MakeBank()).value();
  mixer.OpenStream().value()->TryPush({.bank = bank, .action = ObjectMove{}});
  Render(mixer, 1);
  EXPECT_EQ(mixer.statistics().dropped_count, 1U);
}

}  // namespace
}  // namespace carillon
