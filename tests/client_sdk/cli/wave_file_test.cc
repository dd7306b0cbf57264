// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/wave_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace carillon::cli {
namespace {

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
