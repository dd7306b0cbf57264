// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/wave_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <sndfile.hh>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

absl::Status NotWritable(const std::string& path, absl::string_view why) {
  absl::ConsumePrefix(&why, "System error : ");
  absl::ConsumeSuffix(&why, ".");
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, ": ", why, "; choose another file"));
}

int SampleForm(int bits) {
  return bits == 16 ? SF_FORMAT_PCM_16 : bits == 32 ? SF_FORMAT_FLOAT : SF_FORMAT_PCM_24;
}

}  // namespace

struct WaveFile::Sound {
  std::string path;
  int memory;  ///< descriptor of the file in memory that goes to stdout; -1: none
  SndfileHandle file;
  bool clips = false;  ///< see WaveFormat
  std::vector<float> clipped{};

  ~Sound() {
    if (memory >= 0) close(memory);
  }
};

WaveFile::WaveFile(std::unique_ptr<Sound> sound) : sound_(std::move(sound)) {}
WaveFile::WaveFile(WaveFile&&) noexcept = default;
WaveFile& WaveFile::operator=(WaveFile&&) noexcept = default;
WaveFile::~WaveFile() = default;

absl::StatusOr<WaveFile> WaveFile::Create(const std::string& path, const WaveFormat& format) {
  const int memory = path == "-" ? memfd_create("wave", MFD_CLOEXEC) : -1;
  if (path == "-" && memory < 0) return NotWritable(path, std::strerror(errno));
  const int form = SF_FORMAT_WAV | SampleForm(format.bits);
  const int channels = static_cast<int>(format.channel_count);
  const int rate = static_cast<int>(format.sample_rate_hz);
  auto sound = std::make_unique<Sound>();
  sound->path = path;
  sound->memory = memory;
  sound->file = memory < 0 ? SndfileHandle(path, SFM_WRITE, form, channels, rate)
                           : SndfileHandle(memory, false, SFM_WRITE, form, channels, rate);
  // Its conversion to bool says nothing about the file.
  if (sound->file.error() != SF_ERR_NO_ERROR) return NotWritable(path, sound->file.strError());
  // It has the time of day, and would make each file of the same samples another.
  sound->file.command(SFC_SET_ADD_PEAK_CHUNK, nullptr, SF_FALSE);
  sound->clips = format.clips();
  return WaveFile(std::move(sound));
}

absl::Status WaveFile::Finish() {
  sound_->file = SndfileHandle();
  if (sound_->memory < 0) return absl::OkStatus();
  lseek(sound_->memory, 0, SEEK_SET);
  std::array<char, 65536> piece;
  for (ssize_t count; (count = read(sound_->memory, piece.data(), piece.size())) > 0;) {
    const auto size = static_cast<size_t>(count);
    if (std::fwrite(piece.data(), 1, size, stdout) != size) {
      return NotWritable(sound_->path, std::strerror(errno));
    }
  }
  return std::fflush(stdout) == 0 ? absl::OkStatus()
                                  : NotWritable(sound_->path, std::strerror(errno));
}

absl::Status WaveFile::Write(std::span<const float> samples) {
  // A sample beyond full scale would become one of the other sign. The library's own clipping
  // truncates where its conversion without clipping rounds.
  if (sound_->clips) {
    sound_->clipped.assign(samples.begin(), samples.end());
    for (float& sample : sound_->clipped) sample = std::clamp(sample, -1.0F, 1.0F);
    samples = sound_->clipped;
  }
  const auto count = static_cast<sf_count_t>(samples.size());
  if (sound_->file.write(samples.data(), count) == count) return absl::OkStatus();
  return NotWritable(sound_->path, sound_->file.strError());
}

}  // namespace carillon::cli
