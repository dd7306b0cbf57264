// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/output.h"
#include "client_sdk/cli/wave_file.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

void PrintSummary(const RenderOptions& options, const v1::RenderSummary& summary,
                  uint32_t sample_rate_hz) {
  absl::PrintF("%s: %.2f s, %d impulses, peak %s\n", options.out,
               static_cast<double>(summary.frame_count()) / sample_rate_hz,
               summary.accepted_count(), Decibels(summary.peak()));
  absl::PrintF("%.3g Pa, true peak %s, whole sound %s, loudest 0.4 s %s\n", summary.peak_pa(),
               Decibels(summary.true_peak()),
               Loudness(summary.has_integrated_lufs(), summary.integrated_lufs()),
               Loudness(summary.has_loudest_momentary_lufs(), summary.loudest_momentary_lufs()));
  if (summary.rejected_count() > 0) {
    absl::PrintF("%d impulses could not be used; the newest: %s: %s\n", summary.rejected_count(),
                 summary.last_rejection().reason(), summary.last_rejection().message());
  }
  if (summary.limited_frame_count() > 0) {
    absl::PrintF("the limiter worked in %d frames; smaller gains would avoid it\n",
                 summary.limited_frame_count());
  }
}

}  // namespace

absl::Status Render(const client::Client& daemon, const RenderOptions& options, bool json) {
  auto trace = client::ContactTraceReader::Open(options.trace);
  if (!trace.ok()) return trace.status();
  v1::RenderSettings settings;
  settings.set_sample_rate_hz(options.sample_rate_hz);
  settings.set_channel_count(options.channel_count);
  settings.set_tail_s(options.tail_s);

  std::optional<WaveFile> file;
  absl::Status written;
  const auto write = [&](const client::AudioBlock& block) {
    if (!file) {
      auto created = WaveFile::Create(options.out, block.sample_rate_hz, block.channel_count);
      written = created.status();
      if (created.ok()) file = *std::move(created);
    }
    if (written.ok()) written = file->Write(block.samples);
    return written.ok();
  };
  const auto summary = daemon.Render(settings, *trace, write);
  if (!written.ok()) return written;
  if (!summary.ok()) return summary.status();
  if (!file) {
    return Refusal(absl::StatusCode::kInvalidArgument, "TRACE_EMPTY",
                   absl::StrCat(options.trace,
                                ": holds no contact, so there is nothing to hear; "
                                "record a simulation in which something is struck"));
  }
  if (json) {
    PrintJson(*summary);
  } else {
    PrintSummary(options, *summary, options.sample_rate_hz);
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
