// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/rendered_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <vector>

#include "client_sdk/cli/output/wave_file.h"

namespace carillon::cli {
namespace {

constexpr uint64_t kFadeFrames = 10;

RenderedForm FormOf(uint64_t frame_count, uint64_t fade_frame_count = kFadeFrames) {
  RenderedForm form;
  form.frame_count = frame_count;
  form.fade_frame_count = fade_frame_count;
  return form;
}

/// Writes `sound` in blocks of `block` samples to a file of 32 bits, and reads that file back.
struct Written {
  Written(const std::vector<float>& sound, size_t block, RenderedForm form) {
    form.path = testing::TempDir() + "RenderedFile" + std::to_string(getpid()) + ".wav";
    form.format.bits = 32;
    RenderedFile file(form);
    const std::span<const float> all(sound);
    for (size_t at = 0; at < all.size(); at += block) {
      const auto part = all.subspan(at, std::min(block, all.size() - at));
      EXPECT_TRUE(file.Take({.sample_rate_hz = 48000, .channel_count = 1, .samples = part}));
    }
    EXPECT_TRUE(file.Finish().ok());
    cut = file.is_cut();
    summary.set_frame_count(sound.size());
    summary.set_integrated_lufs(-70);
    file.Describe(summary);
    samples.resize(file.frame_count());
    std::ifstream in(form.path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
    std::filesystem::remove(form.path);
    const size_t size = samples.size() * sizeof(float);
    EXPECT_GE(bytes.size(), size);
    std::memcpy(samples.data(), bytes.data() + bytes.size() - size, size);
  }

  std::vector<float> samples;
  bool cut = false;
  v1::RenderSummary summary;
};

TEST(RenderedFile, ALongerSoundIsCutAndFadesOutAndAShorterOneIsFollowedBySilence) {
  for (const size_t frames : {95, 100, 130}) {
    const std::vector<float> sound(frames, 0.5F);
    for (const size_t block : {1, 7, 33, 64, 130}) {
      const Written written(sound, block, FormOf(100));
      ASSERT_EQ(written.samples.size(), 100U) << block;
      EXPECT_EQ(written.cut, frames > 100);
      for (size_t i = 0; i < 100; ++i) {
        if (frames <= 100) {
          EXPECT_EQ(written.samples[i], i < frames ? 0.5F : 0) << block << " " << i;
          continue;
        }
        const double part = i < 90 ? 0 : static_cast<double>(i - 90) / kFadeFrames;
        EXPECT_NEAR(written.samples[i], 0.25 + 0.25 * std::cos(std::numbers::pi * part), 1e-6)
            << block << " " << i;
      }
    }
  }
}

TEST(RenderedFile, ThePeakOfAFileThatIsCutIsThatOfItsOwnSamples) {
  std::vector<float> sound(130, 0.25F);
  sound[120] = 1;
  RenderedForm form = FormOf(100);
  form.normalize = true;
  const Written written(sound, 64, form);
  EXPECT_FLOAT_EQ(*std::ranges::max_element(written.samples), 0.9F);
}

TEST(RenderedFile, TheLoudnessIsThatOfTheSamplesInTheFile) {
  constexpr uint64_t kRate = 48000, kLength = kRate;
  std::vector<float> sound(3 * kRate);
  for (size_t i = 0; i < sound.size(); ++i) {
    const double t = static_cast<double>(i) / kRate;
    sound[i] = static_cast<float>(0.01 * std::exp(-t) * std::sin(2 * std::numbers::pi * 997 * t));
  }
  for (const bool normalize : {false, true}) {
    RenderedForm form = FormOf(kLength, 480);
    form.normalize = normalize;
    const Written written(sound, 4096, form);
    LoudnessMeter meter(kRate, 1);
    meter.Add(written.samples);
    EXPECT_EQ(written.summary.frame_count(), kLength);
    EXPECT_FLOAT_EQ(static_cast<float>(written.summary.peak()),
                    std::abs(*std::ranges::max_element(
                        written.samples, {}, [](float sample) { return std::abs(sample); })));
    EXPECT_NEAR(written.summary.integrated_lufs(), meter.integrated().value(), 1e-9);
    EXPECT_NEAR(written.summary.loudest_momentary_lufs(), meter.loudest_momentary().value(), 1e-9);
    EXPECT_NEAR(written.summary.true_peak(), meter.true_peak(), 1e-9);
  }
}

TEST(RenderedFile, ThePeakOfAClippedFileIsFullScale) {
  RenderedForm form = FormOf(48000);
  form.path = testing::TempDir() + "Clipped" + std::to_string(getpid()) + ".wav";
  form.factor = 4;
  RenderedFile file(form);
  const std::vector<float> sound(48000, 0.5F);
  EXPECT_TRUE(file.Take({.sample_rate_hz = 48000, .channel_count = 1, .samples = sound}));
  EXPECT_TRUE(file.Finish().ok());
  std::filesystem::remove(form.path);
  v1::RenderSummary summary;
  file.Describe(summary);
  EXPECT_EQ(summary.peak(), 1);
  EXPECT_EQ(file.clipped_count(), 48000U);
}

TEST(RenderedFile, AFadeAsLongAsTheFileBeginsAtItsBeginning) {
  const Written written(std::vector<float>(30, 1.0F), 4, FormOf(20, 1000));
  ASSERT_EQ(written.samples.size(), 20U);
  EXPECT_EQ(written.samples.front(), 1);
  EXPECT_NEAR(written.samples[10], 0.5, 1e-6);
}

/// Writes samples to a file of 24 bits, and reads them back.
std::vector<int> ThroughAFile(const std::vector<float>& samples) {
  const std::string path = testing::TempDir() + "ThroughAFile.wav";
  {
    auto file = WaveFile::Create(path, {.sample_rate_hz = 48000, .channel_count = 2});
    EXPECT_TRUE(file.ok()) << file.status();
    EXPECT_TRUE(file->Write(samples).ok());
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(file), {}};
  std::filesystem::remove(path);
  const size_t data_bytes = samples.size() * 3;
  EXPECT_GT(bytes.size(), data_bytes);
  std::vector<int> values;
  for (size_t at = bytes.size() - data_bytes; at < bytes.size(); at += 3) {
    values.push_back((bytes[at] << 8 | bytes[at + 1] << 16 | bytes[at + 2] << 24) >> 8);
  }
  return values;
}

TEST(WaveFile, HoldsEverySampleWithin24BitsAndClipsThoseBeyondFullScale) {
  const std::vector<float> samples = {0.0F, 0.5F, -0.5F, 0.25F, -1.0F, 1e-5F, 1.3F, -1.3F};
  const std::vector<int> values = ThroughAFile(samples);
  for (size_t i = 0; i < samples.size(); ++i) {
    // One step of 24 bits.
    EXPECT_NEAR(values[i], std::ldexp(std::clamp(samples[i], -1.0F, 1.0F), 23), 1) << i;
  }
}

TEST(WaveFile, SaysWhyItCannotBeWritten) {
  EXPECT_THAT(WaveFile::Create("/proc/no/such.wav", {}).status().ToString(),
              testing::HasSubstr("OUTPUT_NOT_WRITABLE: /proc/no/such.wav"));
}

}  // namespace
}  // namespace carillon::cli
