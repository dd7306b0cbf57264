// SPDX-License-Identifier: Apache-2.0
//
// The head that Debian's libmysofa1 brings, KEMAR, beside the library's own filters.
#include "server/scene/head_store.h"

#include <gtest/gtest.h>
#include <mysofa.h>

#include <array>
#include <cmath>
#include <complex>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "tests/server/synthesis/voice/heard.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr const char* kKemar = "/usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa";

std::complex<double> ResponseAt(std::span<const float> taps, double frequency_hz, double rate_hz) {
  const std::complex<double> turn = std::polar(1.0, -2 * kPi * frequency_hz / rate_hz);
  std::complex<double> sum = 0, phase = 1;
  for (const float tap : taps) {
    sum += double{tap} * phase;
    phase *= turn;
  }
  return sum;
}

double LevelAt(std::span<const float> taps, double frequency_hz, double rate_hz) {
  return 20 * std::log10(std::abs(ResponseAt(taps, frequency_hz, rate_hz)));
}

TEST(HeadStoreTest, EarsHearAsLateAsSoundTakesAroundAHead) {
  const auto head = *HeadStore().Get(48000);
  for (const double degrees : {0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0}) {
    const auto [left, right] = head->Delays(At(degrees));
    const double angle = degrees * kPi / 180;
    const double woodworth_s = 0.0875 / 343 * (angle + std::sin(angle));
    EXPECT_NEAR((left - right) / 48000, woodworth_s, 1e-4) << degrees;
    const auto mirrored = head->Delays(At(-degrees));
    EXPECT_NEAR(mirrored[1] - mirrored[0], left - right, 2) << degrees;
  }
}

using Spectrum = std::vector<std::complex<double>>;

/// Each 200 Hz up to 16 kHz.
Spectrum SpectrumOf(std::span<const float> sound, double rate_hz) {
  Spectrum spectrum;
  for (double frequency_hz = 200; frequency_hz <= 16000; frequency_hz += 200) {
    spectrum.push_back(ResponseAt(sound, frequency_hz, rate_hz));
  }
  return spectrum;
}

/// The gain and the delay that make one sound of another.
struct Fit {
  double gain = 0, delay_frames = 0;
};

/// What is left of `heard` after the fitted filter, in relation to it, dB.
double ErrorOf(const Spectrum& heard, const Spectrum& filter, const Fit& fit, double rate_hz) {
  double error = 0, power = 0;
  for (size_t i = 0; i < heard.size(); ++i) {
    const double turn = -2 * kPi * 200 * static_cast<double>(i + 1) / rate_hz;
    error += std::norm(heard[i] - filter[i] * std::polar(fit.gain, turn * fit.delay_frames));
    power += std::norm(heard[i]);
  }
  return 10 * std::log10(error / power);
}

/// Finds the delay to a thousandth of a frame, below 300 frames.
Fit FitTo(const Spectrum& heard, const Spectrum& filter, double rate_hz) {
  Fit best;
  double power = 0, most = 0;
  for (const auto& value : filter) power += std::norm(value);
  const auto attempt = [&](double delay_frames) {
    double likeness = 0;
    for (size_t i = 0; i < heard.size(); ++i) {
      const double turn = 2 * kPi * 200 * static_cast<double>(i + 1) / rate_hz;
      likeness += (std::conj(filter[i]) * heard[i] * std::polar(1.0, turn * delay_frames)).real();
    }
    if (likeness <= most) return;
    most = likeness;
    best = {.gain = likeness / power, .delay_frames = delay_frames};
  };
  for (int i = 0; i < 1200; ++i) attempt(i / 4.0);
  for (double step = 0.125; step > 5e-4; step /= 2) {
    const double at = best.delay_frames;
    attempt(at - step);
    attempt(at + step);
  }
  return best;
}

TEST(HeadStoreTest, AClickIsHeardThroughTheFiltersOfTheLibrary) {
  for (const uint32_t rate_hz : {44100U, 48000U}) {
    const auto head = *HeadStore(kKemar).Get(rate_hz);
    int length = 0, error = 0;
    const std::unique_ptr<MYSOFA_EASY, decltype(&mysofa_close)> library(
        mysofa_open(kKemar, static_cast<float>(rate_hz), &length, &error), &mysofa_close);
    ASSERT_TRUE(library);
    Fit fit;  // one for all directions and both ears
    for (int degrees = 0; degrees < 360; degrees += 5) {
      const Vector3 at = At(degrees);
      const Channels heard =
          Heard({.binaural = true}, {.position_m = at}, 2, head, 128, rate_hz).Play(Click(0, 1024));
      std::array<std::vector<float>, 2> filters;
      for (std::vector<float>& filter : filters) filter.resize(static_cast<size_t>(length));
      std::array<float, 2> delays_s{};
      mysofa_getfilter_float(library.get(), static_cast<float>(-at[2]), static_cast<float>(-at[0]),
                             static_cast<float>(at[1]), filters[0].data(), filters[1].data(),
                             &delays_s[0], &delays_s[1]);
      for (const size_t ear : {0U, 1U}) {
        ASSERT_EQ(delays_s[ear], 0) << "KEMAR's delays are in its responses";
        const Spectrum sound = SpectrumOf(heard[ear], rate_hz);
        const Spectrum filter = SpectrumOf(filters[ear], rate_hz);
        if (fit.gain == 0) fit = FitTo(sound, filter, rate_hz);
        // Every 15 degrees the error is smaller than between them.
        EXPECT_LT(ErrorOf(sound, filter, fit, rate_hz), degrees % 15 == 0 ? -60 : -54)
            << degrees << ", ear " << ear << ", " << rate_hz << " Hz";
      }
    }
  }
}

TEST(HeadStoreTest, SoundsAsAtAnotherRate) {
  HeadStore heads;
  const auto respond = [&heads](uint32_t rate_hz) {
    const auto head = *heads.Get(rate_hz);
    EarResponses responses = head->Silent();
    head->Respond(At(40), responses);
    return responses;
  };
  const EarResponses at_48 = respond(48000), at_96 = respond(96000);
  for (const double frequency_hz : {1000.0, 4000.0, 10000.0}) {
    EXPECT_NEAR(LevelAt(at_48[0].taps, frequency_hz, 48000),
                LevelAt(at_96[0].taps, frequency_hz, 96000), 1)
        << frequency_hz;
  }
  EXPECT_EQ(*heads.Get(48000), *heads.Get(48000));  // it is kept
}

TEST(HeadStoreTest, OnlyScenesOfTwoChannelsThatAskForItGetAHead) {
  HeadStore heads;
  SceneSpace space;
  EXPECT_TRUE(heads.Complete(space, 48000, 2).ok());
  EXPECT_EQ(space.head, nullptr);
  space.hearing.binaural = true;
  EXPECT_TRUE(heads.Complete(space, 48000, 1).ok());
  EXPECT_EQ(space.head, nullptr);
  EXPECT_TRUE(heads.Complete(space, 48000, 2).ok());
  EXPECT_NE(space.head, nullptr);
  HeadStore none("/none.sofa");
  EXPECT_FALSE(none.Complete(space, 48000, 2).ok());
}

}  // namespace
}  // namespace carillon
