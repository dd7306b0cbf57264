// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

using testing::Each;

/// Frames of a glide, and the greatest change of its gain from frame to frame: 3/2 of the mean.
constexpr size_t kGlideFrames = 1440;
constexpr double kGreatestStep = 1.5 / kGlideFrames;

const SoundingMode kMode = MakeMode(0, 440, -0.5, 20);

/// The part of a glide that has passed after n frames.
double Glided(size_t n) {
  const double t = std::min(static_cast<double>(n) / kGlideFrames, 1.0);
  return t * t * (3 - 2 * t);
}

/// A strike on the bus, or on the default one, of a mixer alone.
std::vector<float> RenderAlone(const MixerSettings& settings, uint64_t frame, size_t block_count,
                               std::optional<double> bus_gain = std::nullopt) {
  Mixer mixer(settings);
  const BusId bus = bus_gain ? mixer.OpenBus(*bus_gain).value() : BusId();
  const BankId bank = mixer.Add(MakeBank({kMode}), nullptr, bus).value();
  Strike(*mixer.OpenStream(8).value(), bank, frame);
  return Render(mixer, block_count);
}

class BusesTest : public testing::Test {
 protected:
  void Strike(BankId bank, uint64_t frame) { carillon::Strike(*stream_, bank, frame); }
  std::vector<float> Render(size_t block_count) { return carillon::Render(mixer_, block_count); }

  Mixer mixer_;
  BusId bus_ = mixer_.OpenBus().value();
  BankId bank_ = mixer_.Add(MakeBank({kMode}), nullptr, bus_).value();
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(64).value();
};

TEST_F(BusesTest, AGlideOfAGainHasNoStep) {
  Strike(bank_, 0);
  const size_t begin = Render(40).size();
  mixer_.SetGain(bus_, 0.25);
  const std::vector<float> frames = Render(40);
  double before = 1;
  for (size_t n = 0; n < frames.size(); ++n) {
    const double gain = 1 - 0.75 * Glided(n);
    EXPECT_NEAR(frames[n], gain * SumOfStrikes({.modes = {kMode}}, {0}, begin + n), 1e-6) << n;
    EXPECT_LE(std::abs(gain - before), 0.75 * kGreatestStep * 1.001) << n;
    before = gain;
  }
}

TEST_F(BusesTest, AGlideThatTurnsRoundBeginsWhereItIs) {
  Strike(bank_, 0);
  Render(40);
  std::vector<float> frames;
  for (const double gain : {0.0, 1.0, 0.0, 0.5, 1.0}) {
    mixer_.SetGain(gain);
    const std::vector<float> some = Render(5);
    frames.insert(frames.end(), some.begin(), some.end());
  }
  // The sound of the mode times a gain between zero and one: each sample lies near its neighbours.
  const double peak = std::abs(20 * kSamplesPerVolumeVelocity / kMode.damped_rad_per_s);
  const double greatest = peak * (kMode.damped_rad_per_s * kTestFrameS + kGreatestStep);
  for (size_t n = 1; n < frames.size(); ++n) {
    EXPECT_LE(std::abs(frames[n] - frames[n - 1]), greatest) << n;
  }
}

TEST_F(BusesTest, AMutedBusRingsOnUnheard) {
  Strike(bank_, 0);
  mixer_.SetGain(bus_, 0);
  const size_t silent = Render(40).size();
  EXPECT_THAT(Render(10), Each(0.0F));
  mixer_.SetGain(bus_, 1);
  Render(12);
  ExpectStrikes(Render(10), kMode, silent + 22 * 128, {0});
}

TEST_F(BusesTest, WhatABusWasToldBeforeItsFirstBankHoldsAtOnce) {
  const BusId bus = mixer_.OpenBus().value();
  Render(5);
  mixer_.SetGain(bus, 0);
  mixer_.Stop(bus);
  Render(5);
  const BankId bank = mixer_.Add(MakeBank({kMode}), nullptr, bus).value();
  Strike(bank, 0);
  EXPECT_THAT(Render(20), Each(0.0F));
  mixer_.SetGain(bus, 1);
  Render(12);
  // The strike came after the stop, and rings on.
  ExpectStrikes(Render(10), kMode, 42 * 128, {10 * 128});
}

TEST(Buses, AGainOfABusAndOneOfAllGiveTheSameBits) {
  const std::vector<float> frames = RenderAlone({.gain = 0.3}, 77, 64);
  EXPECT_EQ(RenderAlone({}, 77, 64, 0.3), frames);
  EXPECT_GT(*std::ranges::max_element(frames), 0.001F);
}

/// Keeps what a bus sounds like.
class Stem final : public BusListener {
 public:
  void Hear(uint64_t first_frame, std::span<const float> block) noexcept override {
    first_frames.push_back(first_frame);
    frames.insert(frames.end(), block.begin(), block.end());
  }
  std::vector<uint64_t> first_frames;
  std::vector<float> frames;
};

TEST_F(BusesTest, ABusSoundsTheSameBitForBitWhateverOthersDo) {
  Stem stem;
  mixer_.Tap(bus_, &stem);
  const BankId other = mixer_.Add(MakeBank({kMode}), nullptr, mixer_.OpenBus().value()).value();
  Strike(other, 3);
  Strike(bank_, 200);
  Strike(other, 1111);
  EXPECT_NE(Render(30), stem.frames);
  EXPECT_EQ(stem.frames, RenderAlone({}, 200, 30));
  EXPECT_EQ(stem.first_frames.front(), 0u);
  EXPECT_EQ(stem.first_frames.back(), 29u * 128);
}

TEST_F(BusesTest, AStopFadesWithoutAStepAndEndsWhatRings) {
  Strike(bank_, 0);
  const size_t begin = Render(40).size();
  mixer_.Stop(bus_);
  const std::vector<float> frames = Render(12);
  for (size_t n = 0; n < frames.size(); ++n) {
    const double right = (1 - Glided(n)) * SumOfStrikes({.modes = {kMode}}, {0}, begin + n);
    EXPECT_NEAR(frames[n], right, 1e-6) << n;
  }
  EXPECT_THAT(Render(60), Each(0.0F));
  EXPECT_EQ(mixer_.statistics().active_mode_count, 0u);
}

TEST_F(BusesTest, AStopEndsImpulsesThatWaitAndNoneThatComeLater) {
  Strike(bank_, 5000);
  Render(1);
  mixer_.Stop(bus_);
  EXPECT_THAT(Render(60), Each(0.0F));
  Strike(bank_, 8000);
  ExpectStrikes(Render(20), kMode, 61 * 128, {8000});
}

TEST(Buses, AStopEndsSoundOnItsWayToTheListener) {
  Mixer mixer;
  const HearingSettings delayed{.propagation_delay = true};
  const auto voice = std::make_shared<Voice>(Voice::Settings{.hearing = delayed},
                                             Place{.position_m = {100, 0, 0}}, Place());
  const BusId bus = mixer.OpenBus().value();
  const BankId bank = mixer.Add(MakeBank({kMode}), voice, bus).value();
  Strike(*mixer.OpenStream(8).value(), bank);
  Render(mixer, 20, 20);
  mixer.Stop(bus);
  EXPECT_THAT(Render(mixer, 200, 200), Each(0.0F));
}

TEST_F(BusesTest, ALoadThatRestsStaysSilentAfterAStop) {
  const auto hold = [&](uint64_t frame) {
    stream_->TryPush(
        {.bank = bank_,
         .frame = frame,
         .action = SurfaceForce{.at = MakeUnitImpulse().at, .force_newtons = {9, 0, 0}}});
    stream_->TryPush({.bank = bank_, .frame = frame, .action = ForceKnot{.step_s = 0.01F}});
  };
  for (uint64_t step = 0; step < 20; ++step) hold(480 * step);
  Render(75);
  mixer_.Stop(bus_);
  Render(12);
  for (uint64_t step = 20; step < 40; ++step) hold(480 * step);
  EXPECT_LT(Peak(Render(60)), 1e-6);
}

TEST(Buses, ABusThatWasClosedIsOpenedAgainWhenItsBanksHaveGone) {
  Mixer mixer({.most_buses = 2});
  const BusId bus = mixer.OpenBus(0.5).value();
  const BankId bank = mixer.Add(MakeBank({kMode}), nullptr, bus).value();
  EXPECT_THAT(std::string(mixer.OpenBus().status().message()),
              testing::HasSubstr("TOO_MANY_SCENES"));
  mixer.FadeOut(bank);
  mixer.CloseBus(bus);
  EXPECT_FALSE(mixer.OpenBus().ok());
  Render(mixer, 40);
  mixer.CollectGarbage();
  EXPECT_EQ(mixer.OpenBus().value(), bus);
}

}  // namespace
}  // namespace carillon
