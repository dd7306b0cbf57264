// SPDX-License-Identifier: Apache-2.0
// Impulses and banks that are too many for a block.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "server/synthesis/mixer.h"
#include "server/synthesis/schedule/loudness_triage.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

TEST(LoudnessTriage, AllAreExactWithinTheBound) {
  LoudnessTriage triage;
  triage.Clear();
  for (int i = 1; i <= 10; ++i) triage.Note(static_cast<float>(i), 10, 3);
  EXPECT_EQ(triage.Decide(100), 100);
  EXPECT_EQ(triage.Treat(1), Treatment::kExact);
  EXPECT_EQ(triage.shed_below(), 0);
}

TEST(LoudnessTriage, TheLoudestStayExactWhereAllCanBeRenderedMerged) {
  LoudnessTriage triage;
  triage.Clear();
  for (int i = 0; i < 10; ++i) triage.Note(std::exp2(static_cast<float>(i)), 10, 3);
  EXPECT_LE(triage.Decide(45), 45);  // two exact and eight merged
  for (int i = 0; i < 8; ++i) EXPECT_EQ(triage.Treat(std::exp2(float(i))), Treatment::kMerged);
  for (int i = 8; i < 10; ++i) EXPECT_EQ(triage.Treat(std::exp2(float(i))), Treatment::kExact);
}

TEST(LoudnessTriage, TheLeastAudibleAreShed) {
  LoudnessTriage triage;
  triage.Clear();
  for (int i = 0; i < 10; ++i) triage.Note(std::exp2(static_cast<float>(i)), 10, 3);
  triage.Note(std::numeric_limits<float>::quiet_NaN(), 10, 3);
  EXPECT_EQ(triage.Decide(13), 12);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(triage.Treat(std::exp2(float(i))), Treatment::kShed);
  for (int i = 6; i < 10; ++i) EXPECT_EQ(triage.Treat(std::exp2(float(i))), Treatment::kMerged);
  EXPECT_GT(triage.shed_below(), std::exp2(5.0F));
  EXPECT_LE(triage.shed_below(), std::exp2(6.0F));
  EXPECT_EQ(triage.Decide(0), 0);
  EXPECT_EQ(triage.Treat(std::exp2(9.0F)), Treatment::kShed);
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

std::unique_ptr<OscillatorBank> MakeBank(double coupling = 1) {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 160; ++m) {
    sounding.modes.push_back(MakeMode(m, 100 + 100 * m, -3, coupling));
  }
  return std::make_unique<OscillatorBank>(sounding, MakeUniformShapes(160, 1e-3F),
                                          OscillatorBankSettings{});
}

/// Mixer that may take so much of real time, where a unit of work takes a nanosecond.
MixerSettings Bounded(const Clock& clock, double most_load) {
  return {.most_banks = 512, .clock = &clock, .most_load = most_load};
}

struct Struck {
  MixerStatistics statistics;
  std::vector<float> sound;
};

/// One loud strike among `count` quiet ones, all in one block.
Struck StrikeAtOnce(const MixerSettings& settings, int count) {
  Mixer mixer(settings);
  const BankId bank = mixer.Add(MakeBank()).value();
  const auto stream = mixer.OpenStream(4096).value();
  SurfaceImpulse quiet = MakeUnitImpulse();
  quiet.impulse_newton_seconds[0] = 1e-4F;
  for (int i = 0; i < count; ++i) {
    stream->TryPush({.bank = bank, .frame = static_cast<uint64_t>(i % 128), .action = quiet});
  }
  stream->TryPush({.bank = bank, .frame = 64, .action = MakeUnitImpulse()});
  Struck struck{.statistics = {}, .sound = std::vector<float>(512)};
  for (size_t start = 0; start < 512; start += 128) {
    mixer.Render(std::span(struck.sound).subspan(start, 128));
  }
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
  const TestClock clock;
  Mixer mixer(Bounded(clock, 0.7));
  const BankId bank = mixer.Add(MakeBank()).value();
  // Their 100 units each are more than the 1.87e6 of a block.
  constexpr size_t kMoves = 20'000;
  const auto stream = mixer.OpenStream(kMoves + 1).value();
  for (size_t i = 0; i < kMoves; ++i) stream->TryPush({.bank = bank, .action = ListenerMove{}});
  stream->TryPush({.bank = bank, .action = MakeUnitImpulse()});
  std::vector<float> sound(512);
  mixer.Render(sound);
  EXPECT_EQ(mixer.statistics().shed_count, 0U);
  EXPECT_GT(Rms(sound), 0);
}

/// Pushes `count` impulses at `frame` in pieces that the queue of the stream can hold, each of
/// which the mixer takes in a block of its own before `frame`.
void Flood(Mixer& mixer, EventStream& stream, BankId bank, uint64_t frame, size_t count) {
  std::vector<float> block(128);
  for (size_t i = 0; i < count; ++i) {
    if (stream.room() == 0) mixer.Render(block);
    stream.TryPush({.bank = bank, .frame = frame, .action = MakeUnitImpulse()});
  }
  while (mixer.frame() < frame) mixer.Render(block);
  mixer.Render(block);
}

TEST(Overload, TheImpulsesOfABlockAreBoundedAndTheirStreamCountsTheRestAsDropped) {
  const TestClock clock;
  constexpr size_t kMost = kMostImpulsesPerFrame * 128, kCount = 20'000;
  Mixer mixer(Bounded(clock, 0.7));
  const BankId bank = mixer.Add(MakeBank()).value();
  const auto stream = mixer.OpenStream(4096).value();
  Flood(mixer, *stream, bank, 128 * 10, kCount);
  EXPECT_GE(stream->accepted_count(), kMost * 4 / 5);
  EXPECT_LE(stream->accepted_count(), kMost * 4 / 5 + 1);
  EXPECT_EQ(stream->dropped_count(), kCount - stream->accepted_count());
  EXPECT_EQ(mixer.statistics().dropped_count, stream->dropped_count());
  // The places are free again.
  Flood(mixer, *stream, bank, mixer.frame() + 128 * 10, 4000);
  EXPECT_EQ(stream->dropped_count() + stream->accepted_count(), kCount + 4000);
  EXPECT_GE(stream->accepted_count(), kMost * 4 / 5 + 4000);
}

TEST(Overload, LateImpulsesAreBoundedInTheBlockInWhichTheySound) {
  const TestClock clock;
  Mixer mixer(Bounded(clock, 0.7));
  const BankId bank = mixer.Add(MakeBank()).value();
  const auto stream = mixer.OpenStream(16384).value();
  std::vector<float> block(128);
  mixer.Render(block);
  for (size_t i = 0; i < 16384; ++i) stream->TryPush({.bank = bank, .action = MakeUnitImpulse()});
  mixer.Render(block);
  EXPECT_LE(stream->late_count(), kMostImpulsesPerFrame * 128);
  EXPECT_EQ(stream->late_count() + stream->dropped_count(), 16384U);
}

TEST(Overload, ABlockThatASceneFloodsHasPlacesForTheImpulsesOfAnother) {
  const TestClock clock;
  Mixer mixer(Bounded(clock, 0.7));
  const BusId flooding = mixer.OpenBus().value(), other = mixer.OpenBus().value();
  const BankId flooded = mixer.Add(MakeBank(), nullptr, flooding).value();
  const BankId bank = mixer.Add(MakeBank(), nullptr, other).value();
  const auto flood = mixer.OpenStream(16384).value();
  const auto stream = mixer.OpenStream(1024).value();
  for (size_t i = 0; i < 10'000; ++i) {
    flood->TryPush({.bank = flooded, .frame = 1280, .action = MakeUnitImpulse()});
  }
  std::vector<float> block(128);
  mixer.Render(block);
  EXPECT_GT(flood->dropped_count(), 0U);
  for (size_t i = 0; i < 1000; ++i) {
    stream->TryPush({.bank = bank, .frame = 1280, .action = MakeUnitImpulse()});
  }
  mixer.Render(block);
  EXPECT_EQ(stream->accepted_count(), 1000U);
  EXPECT_EQ(stream->dropped_count(), 0U);
}

TEST(Overload, ThreeHundredThousandImpulsesASecondAllSoundExactly) {
  const TestClock clock;
  Mixer mixer(Bounded(clock, 0.7));
  const BankId bank = mixer.Add(MakeBank()).value();
  const auto stream = mixer.OpenStream(16384).value();
  std::vector<float> block(128);
  for (uint64_t frame = 0; frame < 128 * 50; frame += 128) {
    for (uint64_t i = 0; i < 800; ++i) {
      stream->TryPush({.bank = bank, .frame = frame + i % 128, .action = MakeUnitImpulse()});
    }
    mixer.Render(block);
  }
  EXPECT_EQ(stream->accepted_count(), 40'000U);
  EXPECT_EQ(stream->dropped_count(), 0U);
  EXPECT_EQ(mixer.statistics().merged_count + mixer.statistics().shed_count, 0U);
}

TEST(Overload, ImpulsesOnBanksOfFewModesAreMergedToo) {
  // 6000 impulses of 120 units and more each, of the 533,000 that a block may take.
  const TestClock clock;
  Mixer mixer(Bounded(clock, 0.2));
  const SoundingModes sounding{.modes = {MakeMode(0, 440, -3)}};
  const BankId bank = mixer
                          .Add(std::make_unique<OscillatorBank>(sounding, MakeUniformShapes(1),
                                                                OscillatorBankSettings{}))
                          .value();
  const auto stream = mixer.OpenStream(4096).value();
  Flood(mixer, *stream, bank, 128 * 10, 6000);
  EXPECT_EQ(stream->accepted_count(), 6000U);
  EXPECT_GT(mixer.statistics().merged_count + mixer.statistics().shed_count, 0U);
}

TEST(Overload, AFloodInOneStreamDoesNotHoldUpAnother) {
  Mixer mixer({.most_events_per_block = 1000});
  const BankId bank = mixer.Add(MakeBank()).value();
  const std::unique_ptr<EventStream> streams[] = {mixer.OpenStream(4096).value(),
                                                  mixer.OpenStream(4096).value()};
  for (int i = 0; i < 4000; ++i) streams[0]->TryPush({.bank = bank, .action = MakeUnitImpulse()});
  std::vector<float> block(128);
  // Each block begins with the other stream.
  for (uint64_t taken = 100; taken <= 200; taken += 100) {
    for (int i = 0; i < 100; ++i) streams[1]->TryPush({.bank = bank, .action = MakeUnitImpulse()});
    mixer.Render(block);
    EXPECT_EQ(streams[1]->accepted_count() + streams[1]->late_count(), taken);
    EXPECT_EQ(streams[0]->accepted_count() + streams[0]->late_count(), 9 * taken);
  }
}

TEST(Overload, TheQuietestBanksAreShedUntilTheRestCanRing) {
  TestClock clock;
  clock.set_step(std::chrono::microseconds(30));  // about what a unit of work is to take
  Mixer mixer(Bounded(clock, 0.04));              // 107,000 units: 102 banks in the time domain
  const auto stream = mixer.OpenStream(4096).value();
  std::vector<BankId> banks;
  banks.reserve(400);
  for (int i = 0; i < 400; ++i) {
    banks.push_back(mixer.Add(MakeBank(i < 300 ? 10 : 100)).value());
  }
  std::vector<float> block(128);
  for (size_t first = 0; first < banks.size(); first += 50) {
    for (size_t i = first; i < first + 50; ++i) {
      stream->TryPush({.bank = banks[i], .action = MakeUnitImpulse()});
    }
    for (int i = 0; i < 17; ++i) mixer.Render(block);  // until they ring by spectrum
  }
  EXPECT_EQ(mixer.statistics().active_mode_count, 400u * 160u);
  clock.set_step(std::chrono::milliseconds(10));  // now everything takes long
  for (int i = 0; i < 400 && mixer.statistics().shed_bank_count == 0; ++i) mixer.Render(block);
  mixer.Render(block);
  EXPECT_GT(mixer.statistics().shed_bank_count, 0u);
  // All loud ones ring on, and some of the quiet.
  EXPECT_GE(mixer.statistics().active_mode_count, 100u * 160u);
  EXPECT_LT(mixer.statistics().active_mode_count, 400u * 160u);
}

TEST(Overload, MergedStrikesOfCloseNeighboursAreNearlyTheExactOnes) {
  // Strikes on one point within a tile of frames: merged, they sound at their mean time.
  SoundingModes sounding;
  for (uint32_t m = 0; m < 40; ++m) sounding.modes.push_back(MakeMode(m, 50 + 50 * m, -5));
  OscillatorBank exact(sounding, MakeUniformShapes(40), {});
  OscillatorBank merged(sounding, MakeUniformShapes(40), {});
  TestMix exact_mix, merged_mix;
  const SurfaceImpulse impulse = MakeUnitImpulse();
  const MixerEvent event{.fraction = 0.75F, .action = impulse};
  std::vector<DueEvent> due;
  BlockMix &of_exact = exact_mix.Begin(), &of_merged = merged_mix.Begin();
  for (uint32_t offset = 8; offset < 12; ++offset) {
    due.push_back({.offset = offset, .event = &event});
    exact.Strike(impulse, offset, event.LeadFrames(), of_exact);
  }
  EXPECT_TRUE(merged.StrikeMerged(due, of_merged));
  std::vector<float> a(128), b(128), difference(128);
  exact_mix.Render(exact, a);
  merged_mix.Render(merged, b);
  for (size_t n = 12; n < 128; ++n) difference[n] = a[n] - b[n];
  // Up to 2 kHz, 1.1 frames from the mean, root mean square: 1 - cos, 1 % at the top.
  EXPECT_LT(Rms(difference), 0.01 * Rms(a));
}

TEST(Overload, WhateverStrikesComeWhatLeavesIsFiniteAndWithinFullScale) {
  std::mt19937_64 random(11);
  const std::vector<float> hostile = {0,
                                      -0.0F,
                                      1,
                                      -1,
                                      1e-38F,
                                      1e-45F,
                                      1e10F,
                                      -1e19F,
                                      1e20F,
                                      3e38F,
                                      -3e38F,
                                      1e30F,
                                      std::numeric_limits<float>::infinity(),
                                      -std::numeric_limits<float>::infinity(),
                                      std::numeric_limits<float>::quiet_NaN()};
  const auto any = [&] { return hostile[random() % hostile.size()]; };
  TestClock clock;
  for (const Clock* of_mixer :
       {static_cast<const Clock*>(nullptr), static_cast<const Clock*>(&clock)}) {
    Mixer mixer({.most_banks = 8, .clock = of_mixer, .most_load = 0.02});
    const auto stream = mixer.OpenStream(4096).value();
    std::vector<BankId> banks;
    banks.reserve(8);
    for (int i = 0; i < 8; ++i) banks.push_back(mixer.Add(MakeBank()).value());
    std::vector<float> block(128);
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
      mixer.Render(block);
      for (const float x : block) ASSERT_LE(std::abs(x), 1.0F) << "block " << i;
    }
  }
}

}  // namespace
}  // namespace carillon
