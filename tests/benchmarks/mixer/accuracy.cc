// SPDX-License-Identifier: Apache-2.0
// The mixer against the closed form in double, through strikes and hand-overs.
#include <hwy/targets.h>

#include <cmath>
#include <complex>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "server/synthesis/bank/level.h"
#include "server/synthesis/mixer.h"
#include "tests/benchmarks/mixer/population.h"
#include "tests/benchmarks/mixer/programs.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;
constexpr uint32_t kModes = 800;
constexpr float kShape = 0.02F;  // so that the limiter sleeps

/// Frames of the strikes: some far apart, some close together, some while the modes ring out.
const std::vector<double> kStrikes = {10.25, 4000, 30000.5, 30001, 30100.75, 100000, 260000.125};

std::vector<float> Render(size_t frame_count) {
  Mixer mixer;
  const BankId bank =
      mixer
          .Add(std::make_unique<OscillatorBank>(
              DrawModes(kModes, 1), MakeUniformShapes(kModes, kShape), OscillatorBankSettings{}))
          .value();
  const auto stream = mixer.OpenStream().value();
  for (const double at : kStrikes) {
    stream->TryPush({.bank = bank,
                     .frame = static_cast<uint64_t>(at),
                     .fraction = static_cast<float>(at - std::floor(at)),
                     .action = MakeUnitImpulse()});
  }
  std::vector<float> sound(frame_count / 128 * 128);
  mixer.Render(sound);
  return sound;
}

/// The sum of the closed forms of all strikes; each mode is set anew from its exponential every 64
/// frames.
std::vector<double> ClosedForms(size_t frame_count) {
  std::vector<double> right(frame_count);
  for (const SoundingMode& mode : DrawModes(kModes, 1).modes) {
    const Complex log_q = Complex(mode.decay_rate_per_s, mode.damped_rad_per_s) / kTestSampleRateHz;
    const Complex q = std::exp(log_q);
    const double amplitude =
        kSamplesPerVolumeVelocity * mode.coupling * double{kShape} / mode.damped_rad_per_s;
    for (size_t start = 0; start < frame_count; start += 64) {
      for (const double at : kStrikes) {
        const auto first = std::max(start, static_cast<size_t>(std::ceil(at)));
        if (first >= start + 64) continue;
        Complex z = amplitude * std::exp(log_q * (static_cast<double>(first) - at));
        for (size_t n = first; n < std::min(start + 64, frame_count); ++n) {
          right[n] += z.imag();
          z *= q;
        }
      }
    }
  }
  return right;
}

void Report(const std::vector<float>& sound, const std::vector<double>& right) {
  double worst = 0, peak = 0, error_squares = 0, squares = 0;
  for (size_t n = 0; n < sound.size(); ++n) {
    const double error = sound[n] - right[n];
    worst = std::max(worst, std::abs(error));
    peak = std::max(peak, std::abs(right[n]));
    error_squares += error * error;
    squares += right[n] * right[n];
  }
  std::printf(
      "{\"what\": \"accuracy\", \"target\": \"%s\", \"worst_db\": %.1f, \"rms_db\": %.1f, "
      "\"peak\": %.4f}\n",
      std::string(SimdTarget()).c_str(), 20 * std::log10(worst / peak),
      10 * std::log10(error_squares / squares), peak);
  std::fflush(stdout);
}

}  // namespace

int MeasureAccuracy(const Arguments& arguments) {
  const double seconds = arguments.empty() ? 10 : std::atof(arguments[0].c_str());
  const auto frame_count = static_cast<size_t>(seconds * kTestSampleRateHz) / 128 * 128;
  const std::vector<double> right = ClosedForms(frame_count);
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    Report(Render(frame_count), right);
  }
  return EXIT_SUCCESS;
}

int PrintPopulation(const Arguments& arguments) {
  const auto count = static_cast<uint32_t>(arguments.empty() ? kModes : std::stoul(arguments[0]));
  const uint64_t seed = arguments.size() < 2 ? 1 : std::stoull(arguments[1]);
  for (const SoundingMode& mode : DrawModes(count, seed).modes) {
    std::printf("%.17g %.17g %.17g\n", mode.natural_frequency_hz,
                -std::log(1000.0) / mode.decay_rate_per_s, mode.coupling);
  }
  return EXIT_SUCCESS;
}

}  // namespace carillon
