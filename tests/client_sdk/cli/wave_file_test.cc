// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/wave_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace carillon::cli {
namespace {

TEST(WaveFile, HoldsEverySampleWithin24Bits) {
  const std::string path = testing::TempDir() + "HoldsEverySampleWithin24Bits.wav";
  const std::vector<float> samples = {0.0F, 0.5F, -0.5F, 0.25F, -1.0F, 1e-5F};
  {
    auto file = WaveFile::Create(path, {.sample_rate_hz = 48000, .channel_count = 2});
    ASSERT_TRUE(file.ok()) << file.status();
    ASSERT_TRUE(file->Write(samples).ok());
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(file), {}};
  const size_t data_bytes = samples.size() * 3;
  ASSERT_GT(bytes.size(), data_bytes);
  for (size_t i = 0; i < samples.size(); ++i) {
    const unsigned char* sample = &bytes[bytes.size() - data_bytes + 3 * i];
    const int value = (sample[0] << 8 | sample[1] << 16 | sample[2] << 24) >> 8;
    // One step of 24 bits.
    EXPECT_NEAR(value, std::ldexp(samples[i], 23), 1) << i;
  }
  std::filesystem::remove(path);
}

TEST(WaveFile, SaysWhyItCannotBeWritten) {
  EXPECT_THAT(WaveFile::Create("/proc/no/such.wav", {}).status().ToString(),
              testing::HasSubstr("OUTPUT_NOT_WRITABLE: /proc/no/such.wav"));
}

}  // namespace
}  // namespace carillon::cli
