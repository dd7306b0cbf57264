// SPDX-License-Identifier: Apache-2.0
// Banks whose modes radiate in directions of their own, heard through voices on a mixer.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "tests/server/synthesis/struck_bank.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;
using Vector = std::array<double, 3>;

constexpr double kPi = std::numbers::pi;
constexpr double kSoundSpeed = 343;
constexpr double kStill = -1e-3;  // a decay rate that changes nothing within a second
/// So small that the limiter changes nothing.
constexpr double kCoupling = 0.5;

/// A harmonic and its coefficient c_lm.
struct Harmonic {
  int l = 0, m = 0;
  Complex c{};
};

/// The harmonics of each mode.
using Patterns = std::vector<std::vector<Harmonic>>;

double SquareSum(const std::vector<Harmonic>& harmonics) {
  double sum = 0;
  for (const Harmonic& harmonic : harmonics) sum += std::norm(harmonic.c);
  return sum;
}

/// What the directivity points to.
struct PatternArrays {
  std::vector<uint32_t> first{0}, harmonics;
  std::vector<float> re, im;
};

Directivity MakeDirectivity(const Patterns& patterns, double radius_m) {
  const auto arrays = std::make_shared<PatternArrays>();
  for (const auto& mode : patterns) {
    for (const auto& [l, m, c] : mode) {
      const Complex p = std::pow(Complex(0, -1), l + 1) * c / std::sqrt(SquareSum(mode));
      arrays->harmonics.push_back(static_cast<uint32_t>(l * l + l + m));
      arrays->re.push_back(static_cast<float>(p.real()));
      arrays->im.push_back(static_cast<float>(p.imag()));
    }
    arrays->first.push_back(static_cast<uint32_t>(arrays->harmonics.size()));
  }
  return {.first = arrays->first,
          .harmonics = arrays->harmonics,
          .pattern_re = arrays->re,
          .pattern_im = arrays->im,
          .radius_m = radius_m,
          .owner = arrays};
}

/// Y_lm of transfer.proto, by the standard library.
double RealHarmonic(int l, int m, const Vector& d) {
  const int order = std::abs(m);
  const double ratio = std::tgamma(l - order + 1) / std::tgamma(l + order + 1);
  const double phi = std::atan2(d[1], d[0]);
  const double around = m > 0   ? std::numbers::sqrt2 * std::cos(m * phi)
                        : m < 0 ? std::numbers::sqrt2 * std::sin(order * phi)
                                : 1;
  return std::sqrt((2 * l + 1) / (4 * kPi) * ratio) * around *
         std::assoc_legendre(static_cast<unsigned>(l), static_cast<unsigned>(order), d[2]);
}

/// The sum of c_lm h_l(k r) Y_lm, relative to the pressure of a mode of the same power that
/// radiates equally in all directions, and to its phase.
Complex RelativePressure(const std::vector<Harmonic>& harmonics, double kr, const Vector& d) {
  Complex sum;
  for (const auto& [l, m, c] : harmonics) {
    const auto order = static_cast<unsigned>(l);
    sum += c * Complex(std::sph_bessel(order, kr), std::sph_neumann(order, kr)) *
           RealHarmonic(l, m, d);
  }
  return sum * kr * std::polar(1.0, -kr) * std::sqrt(4 * kPi / SquareSum(harmonics));
}

std::vector<SoundingMode> ModesAt(const std::vector<double>& frequencies_hz, double sigma) {
  std::vector<SoundingMode> modes;
  modes.reserve(frequencies_hz.size());
  for (const double hz : frequencies_hz) {
    modes.push_back(MakeMode(static_cast<uint32_t>(modes.size()), hz, sigma, kCoupling));
  }
  return modes;
}

/// One object with a voice on a mixer.
class Scene {
 public:
  struct Setting {
    std::vector<double> frequencies_hz{440};
    double sigma = kStill;
    Patterns patterns{};          ///< empty: no directivity
    std::vector<float> shapes{};  ///< empty: all modes move alike
    double radius_m = 0.01;
    Vector listener_m{0, 0, 1};
    bool near_field = false;
  };

  explicit Scene(const Setting& setting)
      : voice_(std::make_shared<Voice>(
            Voice::Settings{.hearing = {.directivity = true, .near_field = setting.near_field}},
            Place{}, Place{.position_m = setting.listener_m})) {
    OscillatorBankSettings settings;
    if (!setting.patterns.empty()) {
      settings.directivity = {.directivity = MakeDirectivity(setting.patterns, setting.radius_m),
                              .sound_speed_m_per_s = kSoundSpeed,
                              .near_field = setting.near_field};
    }
    const size_t count = setting.frequencies_hz.size();
    const SoundingModes modes{.modes = ModesAt(setting.frequencies_hz, setting.sigma)};
    const ShapeTable shapes =
        setting.shapes.empty() ? MakeUniformShapes(count) : MakeShapes(setting.shapes, count);
    bank_ = mixer_.Add(std::make_unique<OscillatorBank>(modes, shapes, settings), voice_).value();
  }

  void Send(uint64_t frame, const MixerEvent::Action& action, float fraction = 0) {
    ASSERT_TRUE(
        stream_->TryPush({.bank = bank_, .frame = frame, .fraction = fraction, .action = action}));
  }
  void Strike(uint64_t frame, float fraction = 0) { Send(frame, MakeUnitImpulse(), fraction); }

  std::vector<float> Render(size_t block_count) {
    return carillon::Render(mixer_, block_count, block_count);
  }

 private:
  Mixer mixer_;
  std::shared_ptr<Voice> voice_;
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(65536).value();
  BankId bank_;
};

/// The complex amplitude of a whole number of hertz in the second after the first 48 blocks.
Complex Amplitude(const std::vector<float>& frames, double frequency_hz) {
  Complex sum;
  for (size_t n = 6144; n < 6144 + 48000; ++n) {
    sum += double{frames[n]} *
           std::polar(1.0, -2 * kPi * frequency_hz * static_cast<double>(n) * kTestFrameS);
  }
  return sum / 24000.0;
}

std::vector<float> StrikeOnce(const Scene::Setting& setting) {
  Scene scene(setting);
  scene.Strike(100);
  return scene.Render(432);
}

Vector Direction(double theta, double phi, double distance_m = 1) {
  return {distance_m * std::sin(theta) * std::cos(phi),
          distance_m * std::sin(theta) * std::sin(phi), distance_m * std::cos(theta)};
}

// One mode in each kind of tile: a dipole, a fork-like quadrupole, and one of many harmonics.
const std::vector<double> kFrequenciesHz = {200, 1500, 6000};
const Patterns kPatterns = {
    {{1, 0, {0.3, -0.4}}},
    {{0, 0, {0.2, 0.1}}, {2, -1, {0, 0.3}}, {2, 2, {0.5, 0}}},
    {{0, 0, {0.1, 0}}, {1, 1, {0, -0.2}}, {3, -2, {0.3, 0.2}}, {5, 0, {0.2, -0.1}}, {7, 7, {0, 1}}},
};

TEST(DirectedBanks, EachModeIsHeardAsTheSoundFieldIsNearAndFar) {
  Scene::Setting setting{.frequencies_hz = kFrequenciesHz, .near_field = true};
  for (const double distance_m : {0.05, 0.4, 20.0}) {
    for (const auto& [theta, phi] :
         {std::pair{0.3, 0.2}, {1.2, 2.5}, {2.6, -1.1}, {1.5707, -2.9}}) {
      setting.listener_m = Direction(theta, phi, distance_m);
      setting.patterns = {};
      const std::vector<float> plain = StrikeOnce(setting);
      setting.patterns = kPatterns;
      const std::vector<float> directed = StrikeOnce(setting);
      for (size_t m = 0; m < kFrequenciesHz.size(); ++m) {
        const double kr = 2 * kPi * kFrequenciesHz[m] / kSoundSpeed * distance_m;
        const Complex right = RelativePressure(kPatterns[m], kr, Direction(theta, phi));
        const Complex heard =
            std::conj(Amplitude(directed, kFrequenciesHz[m]) / Amplitude(plain, kFrequenciesHz[m]));
        // A thousandth is 0.01 dB.
        EXPECT_LT(std::abs(heard - right), 1e-3 * std::abs(right) + 1e-5)
            << kFrequenciesHz[m] << " Hz at " << distance_m << " m, theta " << theta;
      }
    }
  }
}

TEST(DirectedBanks, WithoutNearFieldThePatternIsTheFarOneAtAnyDistance) {
  Scene::Setting setting{.frequencies_hz = kFrequenciesHz, .patterns = kPatterns};
  setting.listener_m = Direction(1, 2, 0.05);
  const std::vector<float> near = StrikeOnce(setting);
  setting.listener_m = Direction(1, 2, 1000);
  EXPECT_EQ(near, StrikeOnce(setting));
}

TEST(DirectedBanks, InsideTheEnclosingSphereTheSoundIsThatOnTheSphere) {
  Scene::Setting setting{
      .frequencies_hz = kFrequenciesHz, .patterns = kPatterns, .radius_m = 0.2, .near_field = true};
  setting.listener_m = Direction(1, 2, 0.2);
  const std::vector<float> on = StrikeOnce(setting);
  setting.listener_m = Direction(1, 2, 0.02);
  const std::vector<float> inside = StrikeOnce(setting);
  for (const double hz : kFrequenciesHz) {
    EXPECT_NEAR(std::abs(Amplitude(inside, hz) / Amplitude(on, hz)), 1, 1e-5);
  }
}

/// Strikes of every kind, knots of a rough force, and a listener who never rests.
std::vector<float> RenderBusy(const Patterns& patterns) {
  Scene scene({.frequencies_hz = kFrequenciesHz, .sigma = -20, .patterns = patterns});
  for (uint64_t i = 0; i < 60; ++i) {
    scene.Strike(i * i * 7, 0.3F);
    const auto angle = static_cast<float>(i);
    const Motion motion{.position_m = {std::cos(angle), std::sin(angle), 0}, .glide_frames = 700};
    scene.Send(700 * i, ListenerMove{motion});
  }
  for (uint64_t i = 0; i < 40; ++i) scene.Strike(20000 + i);  // more than a batch holds
  for (uint64_t i = 0; i < 20; ++i) {
    scene.Send(26000 + 800 * i,
               SurfaceForce{.at = MakeUnitImpulse().at, .force_newtons = {10, 0, 0}});
    scene.Send(26000 + 800 * i, ForceKnot{.step_s = 800 / 48000.0F,
                                          .roughness = i < 15 ? 0.3F : 0,
                                          .bandwidth_hz = i < 15 ? 2000.0F : 0});
  }
  return scene.Render(400);
}

TEST(DirectedBanks, ModesThatRadiateEquallySoundAsWithoutDirectivityWhateverHappens) {
  // The second harmonic makes the gains follow the listener without changing them.
  const std::vector<Harmonic> round = {{0, 0, {0, 1}}, {1, 0, {}}};
  const std::vector<float> plain = RenderBusy({});
  const std::vector<float> directed = RenderBusy({round, round, round});
  EXPECT_GT(Peak(plain), 0.001);
  EXPECT_LT(LargestDifference(plain, directed), 2e-6 * Peak(plain));
}

/// The largest error, relative to the largest sample, of predicting each sample of a decaying sine
/// of linearly changing amplitude from the four before it: what remains is how suddenly the
/// amplitude changes its slope.
double Suddenness(const std::vector<float>& frames, double frequency_hz, double sigma) {
  const double a =
      -2 * std::cos(2 * kPi * frequency_hz * kTestFrameS) * std::exp(sigma * kTestFrameS);
  const double b = std::exp(2 * sigma * kTestFrameS);
  double peak = 0, worst = 0;
  // The first blocks contain the strike.
  for (size_t n = 1024; n < frames.size(); ++n) {
    const double error = frames[n] + 2 * a * frames[n - 1] + (a * a + 2 * b) * frames[n - 2] +
                         2 * a * b * frames[n - 3] + b * b * frames[n - 4];
    peak = Larger(peak, std::abs(double{frames[n]}));
    worst = Larger(worst, std::abs(error));
  }
  return 20 * std::log10(worst / peak);
}

const Patterns kDipole = {{{1, 1, {0, 1}}}};
const Patterns kOctupole = {{{0, 0, {0.3, 0}}, {3, 3, {0, 1}}, {3, -2, {0.4, 0}}}};

TEST(DirectedBanks, AListenerWhoWalksRoundHearsNoStep) {
  for (const Patterns& patterns : {kDipole, kOctupole}) {
    Scene scene({.frequencies_hz = {6000}, .patterns = patterns, .listener_m = {1, 0, 0.3}});
    scene.Strike(0);
    for (uint64_t i = 1; i < 120; ++i) {  // steps of 1/60 s, 1.5 radians a second
      const auto angle = static_cast<float>(i) / 40;
      const Motion motion{.position_m = {std::cos(angle), std::sin(angle), 0.3F},
                          .glide_frames = 800};
      scene.Send(800 * i, ListenerMove{motion});
    }
    EXPECT_LT(Suddenness(scene.Render(760), 6000, kStill), -90);
  }
}

TEST(DirectedBanks, ATurningObjectSoundsAsIfTheListenerWalkedRoundTheOtherWay) {
  Scene turning({.frequencies_hz = {6000}, .patterns = kOctupole, .listener_m = {1, 0, 0.3}});
  Scene walking({.frequencies_hz = {6000}, .patterns = kOctupole, .listener_m = {1, 0, 0.3}});
  for (Scene* scene : {&turning, &walking}) scene->Strike(0);
  for (uint64_t i = 1; i < 120; ++i) {
    const auto angle = static_cast<float>(i) / 40;
    turning.Send(800 * i,
                 ObjectMove{{.orientation = {0, 0, std::sin(angle / 2)}, .glide_frames = 800}});
    walking.Send(800 * i, ListenerMove{{.position_m = {std::cos(angle), -std::sin(angle), 0.3F},
                                        .glide_frames = 800}});
  }
  const std::vector<float> turned = turning.Render(760), walked = walking.Render(760);
  // The greatest step is at -90 dB; rounding moves it by some hundredths.
  EXPECT_LT(Suddenness(turned, 6000, kStill), -89.9);
  // Between two poses the listener walks along the chord of the circle.
  EXPECT_LT(LargestDifference(turned, walked), 2e-3 * Peak(turned));
  EXPECT_GT(Peak(turned), 1e-5);
}

TEST(DirectedBanks, AJumpIsACrossFadeOfTenMilliseconds) {
  Scene scene({.frequencies_hz = {6000}, .patterns = kDipole, .listener_m = {1, 0, 0}});
  scene.Strike(0);
  scene.Send(9600, ListenerMove{{.position_m = {-1, 0, 0}}});
  const std::vector<float> frames = scene.Render(300);
  // The gain goes from 1 to -1 in 512 frames.
  EXPECT_LT(Suddenness(frames, 6000, kStill), 20 * std::log10(2 * 2 / 512.0));
  EXPECT_GT(*std::max_element(frames.begin() + 14400, frames.end()), 1e-5);
}

/// The levels of a pair cos(2 phi), sin(2 phi), struck with these modal impulses, around it.
std::vector<double> LevelsAround(std::array<float, 2> impulses) {
  const Patterns pair = {{{2, 2, {0, 1}}}, {{2, -2, {0, 1}}}};
  std::vector<float> shapes(18);
  for (size_t vertex = 0; vertex < 3; ++vertex) {
    shapes[6 * vertex] = impulses[0];
    shapes[6 * vertex + 1] = impulses[1];
  }
  std::vector<double> levels;
  for (int i = 0; i < 16; ++i) {
    Scene scene({.frequencies_hz = {1500, 1500},
                 .patterns = pair,
                 .shapes = shapes,
                 .listener_m = Direction(kPi / 2, i * kPi / 8)});
    scene.Strike(0);
    levels.push_back(std::abs(Amplitude(scene.Render(432), 1500)));
  }
  return levels;
}

TEST(DirectedBanks, ThePairOfARoundBodyHasNodesThatTurnWithTheStrike) {
  for (const double struck_at : {0.0, kPi / 8, 0.3}) {
    const std::vector<double> levels = LevelsAround(
        {static_cast<float>(std::cos(2 * struck_at)), static_cast<float>(std::sin(2 * struck_at))});
    const double loudest = *std::ranges::max_element(levels);
    for (int i = 0; i < 16; ++i) {
      const double right = std::abs(std::cos(2 * (i * kPi / 8 - struck_at)));
      EXPECT_NEAR(levels[static_cast<size_t>(i)] / loudest,
                  right / (struck_at == 0.3 ? std::cos(2 * (kPi / 8 - 0.3)) : 1), 1e-3)
          << i;
    }
  }
}

TEST(DirectedBanks, AStrikeBeginsWithoutAJumpWhateverThePhaseOfItsGain) {
  for (const double phase : {0.0, 0.7, kPi / 2, 2.5}) {
    Scene scene({.patterns = {{{1, 0, std::polar(1.0, phase)}}}});
    scene.Strike(100);
    const std::vector<float> frames = scene.Render(20);
    const std::span<const float> all(frames);
    const double steepest = LargestDifference(all.first(frames.size() - 1), all.subspan(1));
    // A sine, and a cosine with its companion, begin with this slope each.
    EXPECT_LT(steepest, 1.05 * std::numbers::sqrt2 * 2 * kPi * 440 * kTestFrameS * Peak(frames))
        << phase;
  }
}

TEST(DirectedBanks, AStrikeAndAMoveInOneBlockOfSilenceAreHeardFromTheNewPlace) {
  Scene moved({.frequencies_hz = {6000}, .patterns = kOctupole, .listener_m = {1, 0, 0}});
  Scene there({.frequencies_hz = {6000}, .patterns = kOctupole, .listener_m = {0.6, 0.8, 0}});
  moved.Send(30, ListenerMove{{.position_m = {0.6F, 0.8F, 0}}});
  for (Scene* scene : {&moved, &there}) scene->Strike(30);
  EXPECT_LT(LargestDifference(moved.Render(20), there.Render(20)), 1e-6);
}

}  // namespace
}  // namespace carillon
