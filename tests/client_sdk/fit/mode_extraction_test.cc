// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/mode_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client_sdk/fit/residual.h"
#include "tests/client_sdk/fit/struck_body.h"

namespace carillon::fit {
namespace {

ExtractedModes Extract(const Recording& recording) {
  return ExtractModes(FindRings({recording}), [](double) {});
}

TEST(ExtractModes, FindsTheLinesOfASoundAndNoOthers) {
  const std::vector<TrueMode> truth = {{440, 2, 0.3},    {1237, 6, 0.2},    {3811.5, 12, 0.3},
                                       {3990, 20, 0.05}, {9020.3, 40, 0.2}, {15500, 60, 0.2}};
  const ExtractedModes found = Extract(Struck(truth, 1e-4));
  ASSERT_EQ(found.modes.size(), truth.size());
  EXPECT_EQ(found.room.share, 0) << "there is no room";
  for (size_t m = 0; m < truth.size(); ++m) {
    // The noise is 50 to 66 dB below the modes.
    EXPECT_NEAR(found.modes[m].frequency_hz, truth[m].frequency_hz, 0.1);
    EXPECT_NEAR(found.modes[m].decay_per_s, truth[m].decay_per_s,
                0.02 * truth[m].decay_per_s + 0.02);
    EXPECT_NEAR(found.modes[m].level_db, 20 * std::log10(truth[m].amplitude / 0.3), 0.5);
  }
}

TEST(ExtractModes, PartsADoubletThreeHertzApart) {
  const ExtractedModes found = Extract(Struck({{1681.2, 3, 0.3}, {1684.2, 4, 0.25}}, 1e-4));
  ASSERT_EQ(found.modes.size(), 2U);
  EXPECT_NEAR(found.modes[0].frequency_hz, 1681.2, 0.05);
  EXPECT_NEAR(found.modes[1].frequency_hz, 1684.2, 0.05);
  EXPECT_NEAR(found.modes[0].decay_per_s, 3, 0.1);
  EXPECT_NEAR(found.modes[1].decay_per_s, 4, 0.1);
}

TEST(ExtractModes, TellsADecayFromThatOfTheRoom) {
  constexpr double kRoom_per_s = 17, kShare = 0.16;  // a reverberation time of 0.4 s, 8 dB below
  std::vector<TrueMode> truth;
  truth.reserve(10);
  for (int m = 0; m < 10; ++m) truth.push_back({900 + 1400.0 * m, 5 + 3.0 * m, 0.1});
  const Recording heard = InRoom(Struck(truth, 1e-4, 0.8), kRoom_per_s, kShare);
  const ExtractedModes found = ExtractModes(FindRings({heard, heard}), [](double) {});
  ASSERT_GT(found.room.share, 0);
  EXPECT_NEAR(std::log(found.room.decay_per_s / kRoom_per_s), 0, 0.35);
  double deviation = 0;
  int known = 0;
  for (const TrueMode& mode : truth) {
    const auto near = std::ranges::min_element(found.modes, {}, [&](const MeasuredMode& one) {
      return std::abs(one.frequency_hz - mode.frequency_hz);
    });
    ASSERT_NE(near, found.modes.end());
    if (near->decay_error_per_s > 0.45 * near->decay_per_s) continue;
    deviation += std::log(near->decay_per_s / mode.decay_per_s);
    ++known;
  }
  ASSERT_GE(known, 8);
  EXPECT_NEAR(deviation / known, 0, 0.08)
      << "on average; without the room it is some -0.2 of those above 20";
}

TEST(ExtractModes, TellsOfAGainThatWasTurnedDownAtTheBlow) {
  const Recording steady = Struck({{700, 4, 0.2}, {2900, 9, 0.2}, {7010, 20, 0.2}}, 1e-3);
  EXPECT_EQ(Extract(steady).gain_fall_db, 0);
  Recording turned = steady;
  const auto onset = static_cast<size_t>(0.3 * kSampleRate_hz);
  for (size_t n = onset; n < turned.channels[0].size(); ++n) {
    const double t = static_cast<double>(n - onset) / kSampleRate_hz;
    turned.channels[0][n] *= static_cast<float>(std::pow(10, (-12 + 6 * t) / 20));
  }
  EXPECT_NEAR(Extract(turned).gain_fall_db, 10, 2) << "12 dB, of which some return meanwhile";
}

TEST(FindRings, PartsTheStrikesOfOneFile) {
  Recording twice = Struck({{800, 10, 0.3}}, 1e-4, 0.7);
  const std::vector<float> once = twice.channels[0];
  twice.channels[0].insert(twice.channels[0].end(), once.begin(), once.end());
  const std::vector<Ring> rings = FindRings({twice});
  ASSERT_EQ(rings.size(), 2U);
  for (size_t r = 0; r < 2; ++r) {
    const double onset =
        static_cast<double>(rings[r].first_frame + rings[r].onset) / kSampleRate_hz;
    EXPECT_NEAR(onset, 0.3 + static_cast<double>(r) * 1.0, 0.004);
  }
}

TEST(FindRings, ReadsNothingBeyondAFileThatBeginsAmidABlow) {
  // Two pieces of 2 ms, of which the second is louder, look like two blows at the very beginning.
  constexpr size_t kPiece = 96, kCount = 24000;
  Recording recording{.name = "", .sample_rate_hz = kSampleRate_hz, .channels = {{}}};
  recording.channels[0].assign(kCount, 0.9F);
  std::fill_n(recording.channels[0].begin(), kPiece, 0.2F);
  const std::vector<Ring> rings = FindRings({recording});
  ASSERT_EQ(rings.size(), 1U);
  EXPECT_EQ(rings[0].first_frame, kPiece);
  EXPECT_EQ(rings[0].samples.size(), kCount - kPiece);
}

TEST(ResidualOf, TakesTheModesOfAStrikeThatIsALittleOffTheOthers) {
  const std::vector<TrueMode> modes = {{500, 1, 0.1}, {1310, 3, 0.1}, {2740, 6, 0.1}};
  std::vector<TrueMode> higher = modes;
  for (TrueMode& mode : higher) mode.frequency_hz *= 1.0002;
  const std::vector<Ring> rings = FindRings({Struck(modes, 1e-5), Struck(higher, 1e-5)});
  ASSERT_EQ(rings.size(), 2U);
  const ExtractedModes found = ExtractModes(rings, [](double /*done*/) {});
  for (size_t ring = 0; ring < rings.size(); ++ring) {
    const Residual residual = ResidualOf(rings[ring], ring, found.modes);
    ASSERT_EQ(residual.shares.size(), 4U);
    EXPECT_EQ(residual.samples.size(), rings[ring].samples.size());
    // Without a fit to each strike 18 and 4 % are left.
    EXPECT_LT(residual.shares[3].share, 1e-3) << ring;
  }
}

}  // namespace
}  // namespace carillon::fit
