// SPDX-License-Identifier: Apache-2.0
// From the modal model of a tube to the samples: what is heard is what the model and the material
// say.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDt = 1 / kTestSampleRateHz;

/// A free tube by Euler and Bernoulli's beam theory, for unit Young's modulus and density, as a
/// modal model holds it: of each bending mode one along x and one along y, split as a mesh would.
struct Tube {
  static constexpr double kLength_m = 0.505, kOuter_m = 0.0125, kInner_m = 0.0115;
  static constexpr size_t kBendingCount = 6, kModeCount = 2 * kBendingCount;
  static constexpr size_t kRingCount = 201;
  static constexpr uint32_t kMiddle = kRingCount / 2;
  std::vector<double> eigenvalues, couplings;
  std::vector<float> shapes = std::vector<float>(3 * kRingCount * kModeCount);

  Tube() {
    for (size_t n = 0; n < kBendingCount; ++n) AddPair(n, Bend(n));
  }

 private:
  /// beta L of cos(beta L) cosh(beta L) = 1, by Newton from its asymptote.
  static double BetaL(size_t n) {
    double x = (static_cast<double>(n) + 1.5) * kPi;
    for (int i = 0; i < 8; ++i) {
      x -= (std::cos(x) - 1 / std::cosh(x)) / (-std::sin(x) + std::tanh(x) / std::cosh(x));
    }
    return x;
  }

  /// The mode's shape at each ring (the tube has one vertex a ring), mass-normalised.
  static std::vector<double> Bend(size_t n) {
    const double bl = BetaL(n);
    const double s = (std::cosh(bl) - std::cos(bl)) / (std::sinh(bl) - std::sin(bl));
    std::vector<double> shape(kRingCount);
    double square = 0;
    for (size_t i = 0; i < kRingCount; ++i) {
      const double x = bl * static_cast<double>(i) / (kRingCount - 1);
      shape[i] = std::cosh(x) + std::cos(x) - s * (std::sinh(x) + std::sin(x));
      square += shape[i] * shape[i] / kRingCount;
    }
    const double mass = kPi * (kOuter_m * kOuter_m - kInner_m * kInner_m) * kLength_m;
    for (double& value : shape) value /= std::sqrt(square * mass);
    return shape;
  }

  void AddPair(size_t n, const std::vector<double>& shape) {
    const double gyration_squared = (kOuter_m * kOuter_m + kInner_m * kInner_m) / 4;
    const double eigenvalue = std::pow(BetaL(n) / kLength_m, 4) * gyration_squared;
    double mean = 0;
    for (const double value : shape) mean += std::abs(value) / kRingCount;
    for (size_t axis = 0; axis < 2; ++axis) {
      eigenvalues.push_back(eigenvalue * (axis == 0 ? 1 : 1.001));
      couplings.push_back(std::sqrt(eigenvalue) * 4 * (kOuter_m + kInner_m) * kLength_m * mean);
      for (size_t i = 0; i < kRingCount; ++i) {
        shapes[(3 * i + axis) * kModeCount + 2 * n + axis] = static_cast<float>(shape[i]);
      }
    }
  }
};

constexpr SoundingMaterial kAluminum{
    .young_pa = 6.835e10, .density_kg_per_m3 = 2700, .alpha1_s = 1e-7, .alpha2_per_s = 0};

SoundingModes SelectTube(const SoundingMaterial& material) {
  const Tube tube;
  return SelectSoundingModes({tube.eigenvalues, tube.couplings}, material, kTestSampleRateHz);
}

struct Blow {
  uint32_t ring = 13;  // near the end, where every mode moves
  double angle_rad = 0.3;
  double duration_s = 0;
  double impulse_newton_seconds = 0.002;  // well below the limiter
};

/// Two seconds of the tube after a blow.
std::vector<float> StrikeTube(const SoundingMaterial& material, const Blow& blow) {
  const Tube tube;
  Mixer mixer;
  const BankId bank = mixer
                          .Add(std::make_unique<OscillatorBank>(
                              SelectTube(material), MakeShapes(tube.shapes, Tube::kModeCount),
                              OscillatorBankSettings{}))
                          .value();
  const auto stream = mixer.OpenStream().value();
  const SurfaceImpulse impulse{
      .at = {.vertices = {blow.ring, blow.ring, blow.ring}, .weights = {1, 0, 0}},
      .impulse_newton_seconds =
          {static_cast<float>(blow.impulse_newton_seconds * std::cos(blow.angle_rad)),
           static_cast<float>(blow.impulse_newton_seconds * std::sin(blow.angle_rad)), 0},
      .pulse = Pulse::Gaussian(static_cast<float>(blow.duration_s))};
  stream->TryPush({.bank = bank, .action = impulse});
  std::vector<float> sound(96000);
  mixer.Render(sound);
  return sound;
}

/// Magnitude at one frequency, through a Hann window of `frame_count` frames from `start` on.
double Magnitude(std::span<const float> sound, double frequency_hz, size_t start,
                 size_t frame_count) {
  const std::complex<double> step = std::polar(1.0, -2 * kPi * frequency_hz * kDt);
  std::complex<double> sum = 0, phase = 1;
  for (size_t n = 0; n < frame_count; ++n, phase *= step) {
    const double window =
        1 - std::cos(2 * kPi * static_cast<double>(n) / static_cast<double>(frame_count));
    sum += window * sound[start + n] * phase;
  }
  return std::abs(sum);
}

/// Where the magnitude within 1 % of `near_hz` is greatest.
double FindPeakHz(std::span<const float> sound, double near_hz) {
  constexpr size_t kFrames = 9600;
  double best_hz = 0, best = 0, step_hz = 2;
  double low_hz = 0.99 * near_hz, high_hz = 1.01 * near_hz;
  for (; step_hz > 1e-3; step_hz /= 8) {
    for (double f = low_hz; f <= high_hz; f += step_hz) {
      const double magnitude = Magnitude(sound, f, 0, kFrames);
      if (magnitude > best) best = magnitude, best_hz = f;
    }
    low_hz = best_hz - step_hz;
    high_hz = best_hz + step_hz;
  }
  return best_hz;
}

/// Decay between two windows a time constant apart.
double MeasureDecay(std::span<const float> sound, const SoundingMode& mode) {
  constexpr size_t kFrames = 4800;
  const double lag_s = std::min(1.0, -1 / mode.decay_rate_per_s);
  const auto lag = static_cast<size_t>(lag_s / kDt);
  const double hz = mode.damped_rad_per_s / (2 * kPi);
  return std::log(Magnitude(sound, hz, 100 + lag, kFrames) / Magnitude(sound, hz, 100, kFrames)) /
         (static_cast<double>(lag) * kDt);
}

TEST(StruckTube, SpectralPeaksAreTheModelsFrequencies) {
  const auto sound = StrikeTube(kAluminum, {});
  const SoundingModes sounding = SelectTube(kAluminum);
  ASSERT_EQ(sounding.modes.size(), Tube::kModeCount);
  for (const SoundingMode& mode : sounding.modes) {
    const double hz = mode.natural_frequency_hz;
    EXPECT_NEAR(FindPeakHz(sound, hz), hz, std::max(1.0, 1e-3 * hz));
  }
}

TEST(StruckTube, DecaysAreTheMaterials) {
  const auto sound = StrikeTube(kAluminum, {});
  for (const SoundingMode& mode : SelectTube(kAluminum).modes) {
    EXPECT_NEAR(MeasureDecay(sound, mode), mode.decay_rate_per_s, -0.02 * mode.decay_rate_per_s)
        << mode.natural_frequency_hz << " Hz";
  }
}

TEST(StruckTube, LoudnessDoesNotDependOnTheAngleThoughTheMeshSplitsThePairs) {
  double least = INFINITY, most = 0;
  for (int i = 0; i < 24; ++i) {
    const double rms = Rms(StrikeTube(kAluminum, {.angle_rad = i * kPi / 12, .duration_s = 1e-3}));
    least = std::min(least, rms);
    most = std::max(most, rms);
  }
  EXPECT_LT(20 * std::log10(most / least), 0.5);
}

TEST(StruckTube, ComesOutWellBelowFullScale) {
  // Struck in the middle: its odd modes ring at 0.03 to 0.036 of full scale each; the contact
  // leaves little of all but the first.
  const auto sound = StrikeTube(
      kAluminum, {.ring = Tube::kMiddle, .duration_s = 1e-3, .impulse_newton_seconds = 0.02});
  const double peak = *std::ranges::max_element(sound);
  EXPECT_GT(20 * std::log10(peak), -37);
  EXPECT_LT(20 * std::log10(peak), -31);
}

/// Pitch and level of the first mode against plain aluminum; undamped, so that levels compare.
void ExpectChange(SoundingMaterial changed, double pitch, double level) {
  SoundingMaterial plain = kAluminum;
  plain.alpha1_s = changed.alpha1_s = 0;
  const auto before = StrikeTube(plain, {}), after = StrikeTube(changed, {});
  const double before_hz = SelectTube(plain).modes[0].natural_frequency_hz;
  const double after_hz = FindPeakHz(after, pitch * before_hz);
  EXPECT_NEAR(after_hz / FindPeakHz(before, before_hz), pitch, 1e-3 * pitch);
  const double ratio = Magnitude(after, after_hz, 0, 9600) / Magnitude(before, before_hz, 0, 9600);
  EXPECT_NEAR(ratio, level, 0.01 * level);
}

// Level is c phi / omega: docs/physics.md, 2 and 3.
TEST(StruckTube, FourTimesAsStiffSoundsAnOctaveHigherAndAsLoud) {
  SoundingMaterial stiff = kAluminum;
  stiff.young_pa *= 4;
  ExpectChange(stiff, 2, 2.0 / 2);
}

TEST(StruckTube, FourTimesAsDenseSoundsAnOctaveLowerAndAQuarterAsLoud) {
  SoundingMaterial dense = kAluminum;
  dense.density_kg_per_m3 *= 4;
  ExpectChange(dense, 0.5, 0.25 * 0.5 / 0.5);
}

TEST(StruckTube, TwiceAsLargeSoundsAnOctaveLowerAndHalfAsLoud) {
  SoundingMaterial large = kAluminum;
  large.size = 2;
  ExpectChange(large, 0.5, std::pow(2, -0.5) * std::pow(2, -1.5) / 0.5);
}

TEST(StruckTube, TwiceTheDampingDecaysTwiceAsFastAtTheSamePitch) {
  SoundingMaterial damped = kAluminum;
  damped.alpha1_s *= 2;
  const SoundingMode mode = SelectTube(damped).modes[2];
  const SoundingMode before = SelectTube(kAluminum).modes[2];
  EXPECT_NEAR(MeasureDecay(StrikeTube(damped, {}), mode), 2 * before.decay_rate_per_s,
              -0.04 * before.decay_rate_per_s);
  EXPECT_NEAR(mode.natural_frequency_hz, before.natural_frequency_hz, 1e-9);
}

}  // namespace
}  // namespace carillon
