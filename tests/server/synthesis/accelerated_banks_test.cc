// SPDX-License-Identifier: Apache-2.0
// Banks on a mixer that sound by the acceleration of their bodies, too.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/server/synthesis/bank/struck_ball.h"
#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

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
