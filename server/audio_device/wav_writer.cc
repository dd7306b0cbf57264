// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/wav_writer.h"

#include <sndfile.h>

#include <cstdio>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

SNDFILE* Cast(void* file) { return static_cast<SNDFILE*>(file); }

}  // namespace

void WavWriter::CloseFile::operator()(void* file) const { sf_close(Cast(file)); }

WavWriter::WavWriter(File file, std::string path, uint32_t channel_count)
    : file_(std::move(file)), path_(std::move(path)), channel_count_(channel_count) {}

absl::StatusOr<WavWriter> WavWriter::Make(const std::string& path, uint32_t sample_rate_hz,
                                          uint32_t channel_count) {
  SF_INFO info{};
  info.samplerate = static_cast<int>(sample_rate_hz);
  info.channels = static_cast<int>(channel_count);
  info.format = SF_FORMAT_RF64 | SF_FORMAT_FLOAT;
  File file(sf_open(path.c_str(), SFM_WRITE, &info));
  if (file == nullptr) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat("cannot write \"", path, "\": ", sf_strerror(nullptr),
                                "; name a file in a folder that exists and may be written"));
  }
  sf_command(Cast(file.get()), SFC_RF64_AUTO_DOWNGRADE, nullptr, SF_TRUE);
  sf_command(Cast(file.get()), SFC_SET_UPDATE_HEADER_AUTO, nullptr, SF_TRUE);
  return WavWriter(std::move(file), path, channel_count);
}

absl::Status WavWriter::Write(std::span<const float> frames) {
  const auto count = static_cast<sf_count_t>(frames.size() / channel_count_);
  SNDFILE* const file = Cast(file_.get());
  if (failed_) sf_seek(file, frame_count_, SEEK_SET);  // over a frame that was written in part
  failed_ = sf_writef_float(file, frames.data(), count) != count;
  if (!failed_) {
    frame_count_ += count;
    return absl::OkStatus();
  }
  return Refusal(absl::StatusCode::kDataLoss, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat("cannot write on to \"", path_, "\": ", sf_strerror(file),
                              "; its sound is lost until there is space again"));
}

}  // namespace carillon
