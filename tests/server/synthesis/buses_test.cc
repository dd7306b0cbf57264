// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

using testing::Each;

/// Frames of a glide, and the greatest change of its gain from frame to frame: 3/2 of the mean.
constexpr size_t kGlideFrames = 1440;
constexpr double kGreatestStep = 1.5 / kGlideFrames;

class BusesTest : public testing::Test {
 protected:
  static constexpr double kSigma = -0.5;

  static SoundingMode Mode() { return MakeMode(0, 440, kSigma, 20); }
  static std::unique_ptr<OscillatorBank> MakeBank() {
    return std::make_unique<OscillatorBank>(SoundingModes{.modes = {Mode()}}, MakeUniformShapes(1),
                                            OscillatorBankSettings{});
  }
  static double Right(size_t n, double strike_frame) {
    return ClosedForm(Mode(), 1, (static_cast<double>(n) - strike_frame) * kTestFrameS);
  }

  void Strike(BankId bank, uint64_t frame) {
    stream_->TryPush({.bank = bank, .frame = frame, .action = MakeUnitImpulse()});
  }

  std::vector<float> Render(size_t block_count) {
    std::vector<float> frames(128 * block_count);
    for (size_t i = 0; i < block_count; ++i) mixer_.Render(std::span(frames).subspan(128 * i, 128));
    return frames;
  }

  Mixer mixer_;
  BusId bus_ = mixer_.OpenBus().value();
  BankId bank_ = mixer_.Add(MakeBank(), nullptr, bus_).value();
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(64).value();
};

TEST_F(BusesTest, AGlideOfAGainHasNoStep) {
  Strike(bank_, 0);
  const size_t begin = Render(40).size();
  mixer_.SetGain(bus_, 0.25);
  const std::vector<float> frames = Render(40);
  double before = 1;
  for (size_t n = 0; n < frames.size(); ++n) {
    const double t = std::min(static_cast<double>(n) / kGlideFrames, 1.0);
    const double gain = 1 - 0.75 * t * t * (3 - 2 * t);
    EXPECT_NEAR(frames[n], gain * Right(begin + n, 0), 1e-6) << n;
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
  const double peak = std::abs(20 * kSamplesPerVolumeVelocity / Mode().damped_rad_per_s);
  const double greatest = peak * (Mode().damped_rad_per_s * kTestFrameS + kGreatestStep);
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
  const std::vector<float> frames = Render(10);
  for (size_t n = 0; n < frames.size(); ++n) {
    EXPECT_NEAR(frames[n], Right(silent + 22 * 128 + n, 0), 1e-6) << n;
  }
}

TEST_F(BusesTest, WhatABusWasToldBeforeItsFirstBankHoldsAtOnce) {
  const BusId bus = mixer_.OpenBus().value();
  Render(5);
  mixer_.SetGain(bus, 0);
  mixer_.Stop(bus);
  Render(5);
  const BankId bank = mixer_.Add(MakeBank(), nullptr, bus).value();
  Strike(bank, 0);
  EXPECT_THAT(Render(20), Each(0.0F));
  mixer_.SetGain(bus, 1);
  Render(12);
  // The strike came after the stop, and rings on.
  const std::vector<float> frames = Render(10);
  for (size_t n = 0; n < frames.size(); ++n) {
    EXPECT_NEAR(frames[n], Right(42 * 128 + n, 10 * 128), 1e-6) << n;
  }
}

TEST_F(BusesTest, AGainOfABusAndOneOfAllGiveTheSameBits) {
  Mixer other({.gain = 0.3});
  const BankId bank = other.Add(MakeBank()).value();
  const auto stream = other.OpenStream(8).value();
  stream->TryPush({.bank = bank, .frame = 77, .action = MakeUnitImpulse()});
  Mixer mixer;
  const BusId bus = mixer.OpenBus(0.3).value();
  const BankId same = mixer.Add(MakeBank(), nullptr, bus).value();
  const auto events = mixer.OpenStream(8).value();
  events->TryPush({.bank = same, .frame = 77, .action = MakeUnitImpulse()});
  std::vector<float> frames(64 * 128), others(64 * 128);
  mixer.Render(frames);
  other.Render(others);
  EXPECT_EQ(frames, others);
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
  const BankId other = mixer_.Add(MakeBank(), nullptr, mixer_.OpenBus().value()).value();
  Strike(other, 3);
  Strike(bank_, 200);
  Strike(other, 1111);
  const std::vector<float> all = Render(30);

  Mixer alone;
  const BankId bank = alone.Add(MakeBank()).value();
  const auto stream = alone.OpenStream(8).value();
  stream->TryPush({.bank = bank, .frame = 200, .action = MakeUnitImpulse()});
  std::vector<float> frames(30 * 128);
  alone.Render(frames);
  EXPECT_EQ(stem.frames, frames);
  EXPECT_NE(stem.frames, all);
  EXPECT_EQ(stem.first_frames.front(), 0u);
  EXPECT_EQ(stem.first_frames.back(), 29u * 128);
}

TEST_F(BusesTest, AStopFadesWithoutAStepAndEndsWhatRings) {
  Strike(bank_, 0);
  const size_t begin = Render(40).size();
  mixer_.Stop(bus_);
  const std::vector<float> frames = Render(12);
  for (size_t n = 0; n < frames.size(); ++n) {
    const double t = std::min(static_cast<double>(n) / kGlideFrames, 1.0);
    EXPECT_NEAR(frames[n], (1 - t * t * (3 - 2 * t)) * Right(begin + n, 0), 1e-6) << n;
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
  const size_t begin = 61 * 128;
  const std::vector<float> frames = Render(20);
  for (size_t n = 0; n < frames.size(); ++n) {
    EXPECT_NEAR(frames[n], Right(begin + n, 8000), 1e-6) << n;
  }
}

TEST_F(BusesTest, AStopEndsSoundOnItsWayToTheListener) {
  Mixer mixer;
  const HearingSettings delayed{.propagation_delay = true};
  const auto voice = std::make_shared<Voice>(Voice::Settings{.hearing = delayed},
                                             Place{.position_m = {100, 0, 0}}, Place());
  const BusId bus = mixer.OpenBus().value();
  const BankId bank = mixer.Add(MakeBank(), voice, bus).value();
  const auto stream = mixer.OpenStream(8).value();
  stream->TryPush({.bank = bank, .frame = 0, .action = MakeUnitImpulse()});
  std::vector<float> frames(200 * 128);
  mixer.Render(std::span(frames).first(20 * 128));
  mixer.Stop(bus);
  mixer.Render(frames);
  EXPECT_THAT(frames, Each(0.0F));
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
  const std::vector<float> frames = Render(60);
  const auto loud = [](float x, float y) { return std::abs(x) < std::abs(y); };
  EXPECT_LT(std::abs(*std::ranges::max_element(frames, loud)), 1e-6F);
}

TEST_F(BusesTest, ABusThatWasClosedIsOpenedAgainWhenItsBanksHaveGone) {
  Mixer mixer({.most_buses = 2});
  const BusId bus = mixer.OpenBus(0.5).value();
  const BankId bank = mixer.Add(MakeBank(), nullptr, bus).value();
  EXPECT_THAT(std::string(mixer.OpenBus().status().message()),
              testing::HasSubstr("TOO_MANY_SCENES"));
  mixer.FadeOut(bank);
  mixer.CloseBus(bus);
  EXPECT_FALSE(mixer.OpenBus().ok());
  std::vector<float> frames(40 * 128);
  mixer.Render(frames);
  mixer.CollectGarbage();
  EXPECT_EQ(mixer.OpenBus().value(), bus);
}

}  // namespace
}  // namespace carillon
