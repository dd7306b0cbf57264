// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/open_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <latch>
#include <memory>
#include <string>

#include "tests/server/audio_device/manual_clock.h"
#include "tests/server/audio_device/wav.h"

namespace carillon {
namespace {

constexpr DeviceFormat kFormat{.sample_rate_hz = 44100, .block_frame_count = 64};

class OneOverN final : public FrameSource {
 public:
  void Pull(std::span<float> frames) noexcept override {
    for (float& frame : frames) frame = 1.0F / static_cast<float>(++count_);
    if (count_ == 100 * kFormat.block_frame_count) enough.count_down();
  }
  std::latch enough{1};

 private:
  uint32_t count_ = 0;
};

absl::StatusOr<std::unique_ptr<AudioDevice>> Open(const std::string& specification, Clock& clock) {
  return OpenDevice(
      {.specification = specification, .format = kFormat, .program = CARILLON_AUDIO_PROGRAM},
      clock);
}

TEST(OpenDevice, FileDeviceWritesTheSamplesBitForBit) {
  const std::string path = testing::TempDir() + "carillon_file_device.wav";
  ManualClock clock;
  OneOverN source;
  {
    const absl::StatusOr<std::unique_ptr<AudioDevice>> device = Open("file:" + path, clock);
    ASSERT_TRUE(device.ok()) << device.status();
    EXPECT_EQ((*device)->description(), "file: " + path);
    ASSERT_TRUE((*device)->Start(source).ok());
    source.enough.wait();
    (*device)->Stop();
  }
  const Wav wav = ReadWav(path);
  std::filesystem::remove(path);
  EXPECT_EQ(wav.info.samplerate, 44100);
  EXPECT_EQ(wav.info.channels, 1);
  EXPECT_EQ(wav.info.format, SF_FORMAT_WAVEX | SF_FORMAT_FLOAT);
  ASSERT_GE(wav.samples.size(), 100 * kFormat.block_frame_count);
  for (size_t i = 0; i < wav.samples.size(); ++i) {
    ASSERT_EQ(wav.samples[i], 1.0F / static_cast<float>(i + 1));
  }
}

TEST(OpenDevice, KeepsAFileThatIsNoSound) {
  ManualClock clock;
  const std::string path = testing::TempDir() + "KeepsAFileThatIsNoSound.db";
  std::ofstream(path) << "SQLite format 3";
  const absl::Status status = Open("file:" + path, clock).status();
  EXPECT_THAT(status.ToString(), testing::HasSubstr("INVALID_CONFIGURATION: "));
  EXPECT_EQ(std::filesystem::file_size(path), 15U);
  std::filesystem::remove(path);
}

TEST(OpenDevice, RefusesWhatNamesNoDevice) {
  ManualClock clock;
  for (const char* specification : {"", "speaker", "file:", "nullish"}) {
    const absl::Status status = Open(specification, clock).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << specification;
    EXPECT_THAT(status.ToString(), testing::HasSubstr("INVALID_CONFIGURATION: "));
  }
}

TEST(OpenDevice, RefusesASoundCardThatIsNotThereAndPrintsNothing) {
  ManualClock clock;
  testing::internal::CaptureStderr();
  const absl::Status status = Open("portaudio:no such sound card", clock).status();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(status.ToString(), testing::HasSubstr("AUDIO_DEVICE_NOT_FOUND: "));
}

}  // namespace
}  // namespace carillon
