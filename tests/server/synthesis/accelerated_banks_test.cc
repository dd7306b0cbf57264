// SPDX-License-Identifier: Apache-2.0
// Banks on a mixer that sound by the acceleration of their bodies, too.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadiusM = 0.05, kDensity = 700, kAirDensity = 1.204, kSoundSpeed = 343;
constexpr double kHz = 2345, kSigma = -200, kCoupling = 500;
constexpr double kSphereM3 = 4 * kPi / 3 * kRadiusM * kRadiusM * kRadiusM;

/// A ball that translates along x, without rotation, struck towards its centre.
MovedBody Ball() {
  static const std::array<std::array<float, 3>, 3> centre{};
  MovedBody moved{.body = {}, .density_kg_per_m3 = kDensity, .vertices = centre};
  moved.body.volume_m3 = kSphereM3;
  moved.body.inertia_kg_m2 = {1, 1, 1, 0, 0, 0};
  for (size_t axis = 0; axis < 3; ++axis) {
    moved.body.motions[axis].radius_m = kRadiusM;
    moved.body.motions[axis].strengths[axis == 0 ? 3 : axis] = std::sqrt(4 * kPi / 3);
  }
  return moved;
}

/// What one force makes of a ball and of a mode, both integrated in small steps.
struct Integrated {
  std::vector<double> click, mode;
};

/// The ball's pressure at 1 m, the mean over all directions, after the equation
/// y'' = -2 b y' - 2 b^2 y + b f', and the mode's after u'' = 2 sigma u' - (omega^2 + sigma^2) u +
/// f, for the raised cosine f with its middle at `middle_frame`.
Integrated Integrate(double middle_frame, double duration_s, size_t frame_count) {
  constexpr int kSteps = 400;
  const double b = kSoundSpeed / kRadiusM, dt = kTestFrameS / kSteps;
  const double omega = 2 * kPi * kHz, stiffness = omega * omega + kSigma * kSigma;
  const double click_scale =
      kAirDensity * kRadiusM * kRadiusM / kFullScalePa / (kDensity * kSphereM3) / std::sqrt(3.0);
  const auto force = [&](double t) {
    const double since = t - middle_frame * kTestFrameS;
    if (std::abs(since) > duration_s / 2) return 0.0;
    return (1 + std::cos(2 * kPi * since / duration_s)) / duration_s;
  };
  Integrated sound;
  double y = 0, v = 0, u = 0, w = 0;
  for (size_t n = 0; n < frame_count; ++n) {
    sound.click.push_back(click_scale * y);
    sound.mode.push_back(kSamplesPerVolumeVelocity * kCoupling * u);
    for (int i = 0; i < kSteps; ++i) {
      // The rule of the middle point.
      const double f = force((static_cast<double>(n) + (i + 0.5) / kSteps) * kTestFrameS);
      const double y_middle = y + dt / 2 * (v + b * f), u_middle = u + dt / 2 * w;
      const double v_middle = v + dt / 2 * (-2 * b * (v + b * f) - 2 * b * b * y);
      const double w_middle = w + dt / 2 * (2 * kSigma * w - stiffness * u + f);
      y += dt * (v_middle + b * f);
      v += dt * (-2 * b * (v_middle + b * f) - 2 * b * b * y_middle);
      u += dt * w_middle;
      w += dt * (2 * kSigma * w_middle - stiffness * u_middle + f);
    }
  }
  return sound;
}

/// One bank of one mode on a mixer.
class Scene {
 public:
  explicit Scene(bool moves, const MixerSettings& settings = {}) : mixer_(settings) {
    OscillatorBankSettings bank;
    if (moves) bank.moved = Ball();
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
    std::vector<float> frames(128 * block_count);
    mixer_.Render(frames);
    return frames;
  }

  Mixer& mixer() { return mixer_; }

 private:
  Mixer mixer_;
  BankId bank_{};
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(64).value();
};

double Peak(const std::vector<double>& sound) {
  return std::abs(*std::ranges::max_element(sound, {}, [](double x) { return std::abs(x); }));
}

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
TEST(AcceleratedBanks, BallAndModeFollowOneForce) {
  for (const double duration_s : {1e-4, 1e-3, 9e-3}) {
    for (const double frame : {1024.0, 1030.4}) {
      Scene scene(true);
      scene.Strike(frame, duration_s);
      const std::vector<float> sound = scene.Render(16);
      const Integrated right = Integrate(frame, duration_s, sound.size());
      const double peak = Peak(right.click);
      ASSERT_TRUE(duration_s > 5e-3 || Peak(right.mode) > peak / 2) << duration_s;
      const auto over = static_cast<size_t>(frame + duration_s / 2 * kTestSampleRateHz) + 1;
      for (size_t n = over; n < sound.size(); ++n) {
        ASSERT_NEAR(sound[n], right.click[n] + right.mode[n], 2e-3 * peak)
            << duration_s << " " << n;
      }
      const std::vector<double> click = ClickOf(frame, duration_s, 16);
      for (size_t n = 0; n < click.size(); ++n) {
        ASSERT_NEAR(click[n], right.click[n], 2e-3 * peak) << duration_s << " " << n;
      }
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
  const auto after = scene.Render(16);
  EXPECT_EQ(std::ranges::count(after, 0.0F), static_cast<ptrdiff_t>(after.size()));
}

TEST(AcceleratedBanks, AnImpulseWhoseBeginningFindsNoPlaceSoundsAndIsAccepted) {
  Scene scene(true, {.most_buses = 1, .most_pending_events = 1});
  scene.Strike(1030, 1e-3);
  const auto sound = scene.Render(16);
  EXPECT_EQ(std::ranges::find_if(sound, [](float x) { return x != 0; }) - sound.begin(), 1030);
  EXPECT_EQ(scene.mixer().statistics().accepted_count, 1U);
  EXPECT_EQ(scene.mixer().statistics().dropped_count, 1U);  // the beginning
}

}  // namespace
}  // namespace carillon
