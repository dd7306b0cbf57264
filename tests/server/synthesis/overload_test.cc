// SPDX-License-Identifier: Apache-2.0
// Impulses and banks that are too many for a block.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "server/synthesis/schedule/loudness_triage.h"
#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

/// Ten impulses, each twice as loud as the one before, of 10 units each, or 3 if they are merged.
class LoudnessTriageTest : public testing::Test {
 protected:
  LoudnessTriageTest() {
    triage_.Clear();
    for (int i = 0; i < 10; ++i) triage_.Note(LoudnessOf(i), 10, 3);
  }

  static float LoudnessOf(int number) { return std::exp2(static_cast<float>(number)); }

  void ExpectTreatment(int begin, int end, Treatment treatment) const {
    for (int i = begin; i < end; ++i) EXPECT_EQ(triage_.Treat(LoudnessOf(i)), treatment) << i;
  }

  LoudnessTriage triage_;
};

TEST_F(LoudnessTriageTest, TheLoudestStayExactWhereAllCanBeRenderedMerged) {
  EXPECT_LE(triage_.Decide(45), 45);  // two exact and eight merged
  ExpectTreatment(0, 8, Treatment::kMerged);
  ExpectTreatment(8, 10, Treatment::kExact);
}

TEST_F(LoudnessTriageTest, TheLeastAudibleAreShed) {
  triage_.Note(std::numeric_limits<float>::quiet_NaN(), 10, 3);
  EXPECT_EQ(triage_.Decide(13), 12);
  ExpectTreatment(0, 6, Treatment::kShed);
  ExpectTreatment(6, 10, Treatment::kMerged);
  EXPECT_GT(triage_.shed_below(), LoudnessOf(5));
  EXPECT_LE(triage_.shed_below(), LoudnessOf(6));
  EXPECT_EQ(triage_.Decide(0), 0);
  ExpectTreatment(9, 10, Treatment::kShed);
}

/// A clock by which nothing takes any time, or very long.
class TestClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override { return now_ += step_; }
  int64_t UnixMs() const noexcept override { return 0; }
  void set_step(std::chrono::nanoseconds step) { step_ = step; }

 private:
  std::chrono::nanoseconds step_{0};
  mutable std::chrono::nanoseconds now_{0};
};

std::unique_ptr<OscillatorBank> MakeLargeBank(double coupling = 1) {
  std::vector<SoundingMode> modes;
  modes.reserve(160);
  for (uint32_t m = 0; m < 160; ++m) modes.push_back(MakeMode(m, 100 + 100 * m, -3, coupling));
  return MakeBank(modes, 1e-3F);
}

/// Mixer that may take so much of real time, where a unit of work takes a nanosecond.
MixerSettings Bounded(const Clock& clock, double most_load) {
  return {.most_banks = 512, .clock = &clock, .most_load = most_load};
}

/// A large bank on such a mixer.
struct BoundedMixer {
  explicit BoundedMixer(double most_load = 0.7) : mixer(Bounded(clock, most_load)) {}

  TestClock clock;
  Mixer mixer;
  BankId bank = mixer.Add(MakeLargeBank()).value();
};

struct Struck {
  MixerStatistics statistics;
  std::vector<float> sound;
};

/// One loud strike among `count` quiet ones, all in one block.
Struck StrikeAtOnce(const MixerSettings& settings, int count) {
  Mixer mixer(settings);
  const BankId bank = mixer.Add(MakeLargeBank()).value();
  const auto stream = mixer.OpenStream(4096).value();
  for (int i = 0; i < count; ++i) {
    Strike(*stream, bank, static_cast<uint64_t>(i % 128), 0, 1e-4F);
  }
  Strike(*stream, bank, 64);
  Struck struck{.statistics = {}, .sound = Render(mixer, 4)};
  struck.statistics = mixer.statistics();
  return struck;
}

TEST(Overload, WithoutAClockNothingIsMergedOrShed) {
  const Struck struck = StrikeAtOnce({}, 4000);
  EXPECT_EQ(struck.statistics.accepted_count, 4001u);
  EXPECT_EQ(struck.statistics.merged_count + struck.statistics.shed_count, 0u);
}

TEST(Overload, TooManyStrikesAreMergedThenShedAndTheLoudOneIsHeard) {
  const TestClock clock;
  // A bank of 160 lanes: 320 units a strike, 128 where it is merged, of 2.67e6 a block.
  const Struck merged = StrikeAtOnce(Bounded(clock, 0.3), 4000);
  EXPECT_EQ(merged.statistics.accepted_count, 4001u);
  EXPECT_GT(merged.statistics.merged_count, 0u);
  const Struck shed = StrikeAtOnce(Bounded(clock, 0.2), 4000);
  EXPECT_EQ(shed.statistics.accepted_count, 4001u);
  EXPECT_GE(shed.statistics.shed_count, 4000u);
  const std::vector<float> by_itself = StrikeAtOnce({}, 0).sound;
  const double alone = Rms(std::span(by_itself).subspan(128));
  EXPECT_NEAR(Rms(std::span(shed.sound).subspan(128)), alone, 0.01 * alone);
}

TEST(Overload, MovesHoweverManyLeaveWorkForAStrike) {
  BoundedMixer bounded;
  // Their 100 units each are more than the 1.87e6 of a block.
  constexpr size_t kMoves = 20'000;
  const auto stream = bounded.mixer.OpenStream(kMoves + 1).value();
  for (size_t i = 0; i < kMoves; ++i) {
    stream->TryPush({.bank = bounded.bank, .action = ListenerMove{}});
  }
  Strike(*stream, bounded.bank);
  EXPECT_GT(Rms(Render(bounded.mixer, 4, 4)), 0);
  EXPECT_EQ(bounded.mixer.statistics().shed_count, 0U);
}

/// Pushes `count` impulses at `frame` in pieces that the queue of the stream can hold, each of
/// which the mixer takes in a block of its own before `frame`.
void Flood(Mixer& mixer, EventStream& stream, BankId bank, uint64_t frame, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    if (stream.room() == 0) Render(mixer, 1);
    Strike(stream, bank, frame);
  }
  while (mixer.frame() < frame) Render(mixer, 1);
  Render(mixer, 1);
}

TEST(Overload, TheImpulsesOfABlockAreBoundedAndTheirStreamCountsTheRestAsDropped) {
  constexpr size_t kMost = kMostImpulsesPerFrame * 128, kCount = 20'000;
  BoundedMixer bounded;
  const auto stream = bounded.mixer.OpenStream(4096).value();
  Flood(bounded.mixer, *stream, bounded.bank, 128 * 10, kCount);
  EXPECT_GE(stream->accepted_count(), kMost * 4 / 5);
  EXPECT_LE(stream->accepted_count(), kMost * 4 / 5 + 1);
  EXPECT_EQ(stream->dropped_count(), kCount - stream->accepted_count());
  EXPECT_EQ(bounded.mixer.statistics().dropped_count, stream->dropped_count());
  // The places are free again.
  Flood(bounded.mixer, *stream, bounded.bank, bounded.mixer.frame() + 128 * 10, 4000);
  EXPECT_EQ(stream->dropped_count() + stream->accepted_count(), kCount + 4000);
  EXPECT_GE(stream->accepted_count(), kMost * 4 / 5 + 4000);
}

TEST(Overload, LateImpulsesAreBoundedInTheBlockInWhichTheySound) {
  BoundedMixer bounded;
  const auto stream = bounded.mixer.OpenStream(16384).value();
  Render(bounded.mixer, 1);
  for (size_t i = 0; i < 16384; ++i) Strike(*stream, bounded.bank);
  Render(bounded.mixer, 1);
  EXPECT_LE(stream->late_count(), kMostImpulsesPerFrame * 128);
  EXPECT_EQ(stream->late_count() + stream->dropped_count(), 16384U);
}

TEST(Overload, ABlockThatASceneFloodsHasPlacesForTheImpulsesOfAnother) {
  BoundedMixer bounded;
  Mixer& mixer = bounded.mixer;
  const auto add = [&mixer] {
    return mixer.Add(MakeLargeBank(), nullptr, mixer.OpenBus().value()).value();
  };
  const BankId flooded = add(), bank = add();
  const auto flood = mixer.OpenStream(16384).value();
  const auto stream = mixer.OpenStream(1024).value();
  for (size_t i = 0; i < 10'000; ++i) Strike(*flood, flooded, 1280);
  Render(mixer, 1);
  EXPECT_GT(flood->dropped_count(), 0U);
  for (size_t i = 0; i < 1000; ++i) Strike(*stream, bank, 1280);
  Render(mixer, 1);
  EXPECT_EQ(stream->accepted_count(), 1000U);
  EXPECT_EQ(stream->dropped_count(), 0U);
}

TEST(Overload, ThreeHundredThousandImpulsesASecondAllSoundExactly) {
  BoundedMixer bounded;
  const auto stream = bounded.mixer.OpenStream(16384).value();
  for (uint64_t frame = 0; frame < 128 * 50; frame += 128) {
    for (uint64_t i = 0; i < 800; ++i) Strike(*stream, bounded.bank, frame + i % 128);
    Render(bounded.mixer, 1);
  }
  EXPECT_EQ(stream->accepted_count(), 40'000U);
  EXPECT_EQ(stream->dropped_count(), 0U);
  const MixerStatistics statistics = bounded.mixer.statistics();
  EXPECT_EQ(statistics.merged_count + statistics.shed_count, 0U);
}

TEST(Overload, ImpulsesOnBanksOfFewModesAreMergedToo) {
  // 6000 impulses of 120 units and more each, of the 533,000 that a block may take.
  BoundedMixer bounded(0.2);
  const BankId bank = bounded.mixer.Add(MakeBank({MakeMode(0, 440, -3)})).value();
  const auto stream = bounded.mixer.OpenStream(4096).value();
  Flood(bounded.mixer, *stream, bank, 128 * 10, 6000);
  EXPECT_EQ(stream->accepted_count(), 6000U);
  const MixerStatistics statistics = bounded.mixer.statistics();
  EXPECT_GT(statistics.merged_count + statistics.shed_count, 0U);
}

TEST(Overload, AFloodInOneStreamDoesNotHoldUpAnother) {
  Mixer mixer({.most_events_per_block = 1000});
  const BankId bank = mixer.Add(MakeLargeBank()).value();
  const std::unique_ptr<EventStream> streams[] = {mixer.OpenStream(4096).value(),
                                                  mixer.OpenStream(4096).value()};
  for (int i = 0; i < 4000; ++i) Strike(*streams[0], bank);
  // Each block begins with the other stream.
  for (uint64_t taken = 100; taken <= 200; taken += 100) {
    for (int i = 0; i < 100; ++i) Strike(*streams[1], bank);
    Render(mixer, 1);
    EXPECT_EQ(streams[1]->accepted_count() + streams[1]->late_count(), taken);
    EXPECT_EQ(streams[0]->accepted_count() + streams[0]->late_count(), 9 * taken);
  }
}

TEST(Overload, TheQuietestBanksAreShedUntilTheRestCanRing) {
  TestClock clock;
  clock.set_step(std::chrono::microseconds(30));  // about what a unit of work is to take
  Mixer mixer(Bounded(clock, 0.04));              // 107,000 units: 102 banks in the time domain
  const auto stream = mixer.OpenStream(4096).value();
  for (int i = 0; i < 400; ++i) {
    Strike(*stream, mixer.Add(MakeLargeBank(i < 300 ? 10 : 100)).value());
    if (i % 50 == 49) Render(mixer, 17);  // until they ring by spectrum
  }
  EXPECT_EQ(mixer.statistics().active_mode_count, 400u * 160u);
  clock.set_step(std::chrono::milliseconds(10));  // now everything takes long
  for (int i = 0; i < 400 && mixer.statistics().shed_bank_count == 0; ++i) Render(mixer, 1);
  Render(mixer, 1);
  EXPECT_GT(mixer.statistics().shed_bank_count, 0u);
  // All loud ones ring on, and some of the quiet.
  EXPECT_GE(mixer.statistics().active_mode_count, 100u * 160u);
  EXPECT_LT(mixer.statistics().active_mode_count, 400u * 160u);
}

TEST(Overload, WhateverStrikesComeWhatLeavesIsFiniteAndWithinFullScale) {
  std::mt19937_64 random(11);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> hostile = {0,      -0.0F, 1,         -1,         1e-38F,
                                      1e-45F, 1e10F, -1e19F,    1e20F,      3e38F,
                                      -3e38F, 1e30F, kInfinity, -kInfinity, kNan};
  const auto any = [&] { return hostile[random() % hostile.size()]; };
  TestClock clock;
  for (const Clock* of_mixer :
       {static_cast<const Clock*>(nullptr), static_cast<const Clock*>(&clock)}) {
    Mixer mixer({.most_banks = 8, .clock = of_mixer, .most_load = 0.02});
    const auto stream = mixer.OpenStream(4096).value();
    std::vector<BankId> banks;
    banks.reserve(8);
    for (int i = 0; i < 8; ++i) banks.push_back(mixer.Add(MakeLargeBank()).value());
    for (int i = 0; i < 400; ++i) {
      for (int k = 0; k < 40; ++k) {
        const auto vertex = [&] { return static_cast<uint32_t>(random() % 4); };
        MixerEvent event{.bank = banks[random() % banks.size()],
                         .frame = random() % 50 == 0 ? random() : mixer.frame() + random() % 300,
                         .fraction = k % 3 == 0 ? any() : 0.5F};
        const TrianglePoint at{.vertices = {vertex(), vertex(), vertex()},
                               .weights = {any(), any(), any()}};
        if (const size_t kind = random() % 3; kind == 0) {
          event.action = SurfaceImpulse{at, {any(), any(), any()}, Pulse::RaisedCosine(any())};
        } else if (kind == 1) {
          event.action = SurfaceForce{at, {any(), any(), any()}};
        } else {
          event.action = ForceKnot{any(), any(), any()};
        }
        stream->TryPush(event);
      }
      for (const float x : Render(mixer, 1)) ASSERT_LE(std::abs(x), 1.0F) << "block " << i;
    }
  }
}

}  // namespace
}  // namespace carillon
