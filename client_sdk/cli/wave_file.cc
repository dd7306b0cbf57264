// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/wave_file.h"

#include <sndfile.hh>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

absl::Status NotWritable(const std::string& path, const char* why) {
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, ": ", why, "; choose another file"));
}

}  // namespace

struct WaveFile::Sound {
  std::string path;
  SndfileHandle file;
};

WaveFile::WaveFile(std::unique_ptr<Sound> sound) : sound_(std::move(sound)) {}
WaveFile::WaveFile(WaveFile&&) noexcept = default;
WaveFile& WaveFile::operator=(WaveFile&&) noexcept = default;
WaveFile::~WaveFile() = default;

absl::StatusOr<WaveFile> WaveFile::Create(const std::string& path, uint32_t sample_rate_hz,
                                          uint32_t channel_count) {
  SndfileHandle file(path, SFM_WRITE, SF_FORMAT_WAV | SF_FORMAT_PCM_24,
                     static_cast<int>(channel_count), static_cast<int>(sample_rate_hz));
  // Its conversion to bool says nothing about the file.
  if (file.error() != SF_ERR_NO_ERROR) return NotWritable(path, file.strError());
  return WaveFile(std::make_unique<Sound>(Sound{path, file}));
}

absl::Status WaveFile::Write(std::span<const float> samples) {
  const auto count = static_cast<sf_count_t>(samples.size());
  if (sound_->file.write(samples.data(), count) == count) return absl::OkStatus();
  return NotWritable(sound_->path, sound_->file.strError());
}

}  // namespace carillon::cli
