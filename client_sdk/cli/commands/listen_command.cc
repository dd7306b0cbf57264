// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/cli/output/wave_file.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// Shows the level on stderr ten times a second, in one line that is written anew: a bar from -60
/// dB to full scale for the largest sample, and the largest one so far.
class LevelMeter {
 public:
  void Take(const client::AudioBlock& block) {
    for (const float sample : block.samples) peak_ = std::max(peak_, std::abs(sample));
    frame_count_ += block.samples.size() / block.channel_count;
    if (frame_count_ < block.sample_rate_hz / kPerSecond) return;
    Show();
    frame_count_ = 0;
    peak_ = 0;
  }

  void Finish() {
    if (frame_count_ > 0) Show();
    std::fputc('\n', stderr);
  }

 private:
  static constexpr uint64_t kPerSecond = 10;
  static constexpr double kWidth = 40;
  static constexpr double kLowestDb = -60;

  void Show() {
    largest_ = std::max(largest_, peak_);
    const double db = peak_ > 0 ? 20 * std::log10(peak_) : kLowestDb;
    const double part = std::clamp(1 - db / kLowestDb, 0.0, 1.0);
    const auto length = static_cast<size_t>(std::lround(part * kWidth));
    std::string bar(length, '#');
    bar.resize(static_cast<size_t>(kWidth), '.');
    absl::FPrintF(stderr, "\r[%s] %-10s  largest %-10s", bar, Decibels(peak_), Decibels(largest_));
  }

  float peak_ = 0;
  float largest_ = 0;
  uint64_t frame_count_ = 0;
};

/// Writes blocks until the time is over, a signal arrives, or the reader of stdout has gone.
class Recorder {
 public:
  Recorder(const ListenOptions& options, const StopSignal& stop) : options_(options), stop_(stop) {}

  bool Take(const client::AudioBlock& block) {
    if (frame_count_ == 0) Begin(block);
    const size_t frames = Wanted(block);
    if (status_.ok()) Put(block.samples.first(frames * block.channel_count));
    if (meter_) meter_->Take(block);
    frame_count_ += frames;
    lost_frame_count_ = block.lost_frame_count;
    return status_.ok() && !reader_gone_ && frames * block.channel_count == block.samples.size() &&
           !stop_.ArrivesWithin(0);
  }

  /// Completes the file.
  void Finish() {
    if (meter_) meter_->Finish();
    if (file_ && status_.ok()) status_ = file_->Finish();
    if (options_.out.empty() && std::fflush(stdout) != 0) TakeOutputError();
  }

  void PrintAsJson() const {
    PrintJson({{"file", options_.out},
               {"frame_count", frame_count_},
               {"lost_frame_count", lost_frame_count_},
               {"sample_rate_hz", uint64_t{format_.sample_rate_hz}},
               {"channel_count", uint64_t{format_.channel_count}},
               {"peak", double{peak_}}});
  }

  const absl::Status& status() const { return status_; }
  uint64_t lost_frame_count() const { return lost_frame_count_; }

 private:
  void Begin(const client::AudioBlock& block) {
    if (!options_.quiet && isatty(STDERR_FILENO) != 0) meter_.emplace();
    if (options_.out.empty()) {
      absl::FPrintF(stderr, "raw samples: float, little endian, %d Hz, %s\n", block.sample_rate_hz,
                    Counted(block.channel_count, "channel"));
      return;
    }
    format_ = {.sample_rate_hz = block.sample_rate_hz, .channel_count = block.channel_count};
    auto file = WaveFile::Create(options_.out, format_);
    status_ = file.status();
    if (file.ok()) file_ = *std::move(file);
  }

  size_t Wanted(const client::AudioBlock& block) const {
    const size_t frames = block.samples.size() / block.channel_count;
    if (!options_.seconds) return frames;
    const auto limit = static_cast<uint64_t>(*options_.seconds * block.sample_rate_hz);
    return std::min<uint64_t>(frames, limit - frame_count_);
  }

  void Put(std::span<const float> samples) {
    for (const float sample : samples) peak_ = std::max(peak_, std::abs(sample));
    if (file_) {
      status_ = file_->Write(samples);
    } else if (std::fwrite(samples.data(), sizeof(float), samples.size(), stdout) !=
               samples.size()) {
      TakeOutputError();
    }
  }

  /// A reader of stdout that has gone ends the recording without an error.
  void TakeOutputError() {
    reader_gone_ = errno == EPIPE;
    if (reader_gone_) std::clearerr(stdout);
    status_ = FlushOutput();
  }

  const ListenOptions& options_;
  const StopSignal& stop_;
  absl::Status status_;
  WaveFormat format_;
  std::optional<WaveFile> file_;
  std::optional<LevelMeter> meter_;
  float peak_ = 0;
  uint64_t frame_count_ = 0;
  uint64_t lost_frame_count_ = 0;
  bool reader_gone_ = false;
};

}  // namespace

absl::Status Listen(const client::Client& daemon, const ListenOptions& options,
                    const StopSignal& stop, bool json) {
  // A reader of stdout that closes its pipe ends the recording without an error.
  std::signal(SIGPIPE, SIG_IGN);
  Recorder recorder(options, stop);
  v1::ListenRequest request;
  request.set_scene(SceneNamed(options.scene));
  const absl::Status heard =
      daemon.Listen(request, [&](const client::AudioBlock& block) { return recorder.Take(block); });
  recorder.Finish();
  if (recorder.lost_frame_count() > 0) {
    absl::FPrintF(stderr, "%s lost on the way\n", Counted(recorder.lost_frame_count(), "frame"));
  }
  RETURN_IF_ERROR(recorder.status());
  RETURN_IF_ERROR(heard);
  if (json) recorder.PrintAsJson();
  return absl::OkStatus();
}

}  // namespace carillon::cli
