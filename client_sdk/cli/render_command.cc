// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/output.h"
#include "client_sdk/cli/rendered_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// The limiter works from 3 dB below full scale on.
constexpr double kHeadroom = 1.4126;

void PrintSummary(const RenderOptions& options, const v1::RenderSummary& summary,
                  uint32_t sample_rate_hz) {
  std::FILE* const out = options.out == "-" ? stderr : stdout;
  absl::FPrintF(out, "%s: %.2f s, %d impulses, peak %s\n", options.out,
                static_cast<double>(summary.frame_count()) / sample_rate_hz,
                summary.accepted_count(), Decibels(summary.peak()));
  absl::FPrintF(out,
                "%.3g Pa (full scale is %.4g Pa), true peak %s, whole sound %s, loudest 0.4 s %s\n",
                summary.peak_pa(), summary.full_scale_pa(), Decibels(summary.true_peak()),
                Loudness(summary.has_integrated_lufs(), summary.integrated_lufs()),
                Loudness(summary.has_loudest_momentary_lufs(), summary.loudest_momentary_lufs()));
  if (summary.rejected_count() > 0) {
    absl::FPrintF(out, "%d impulses could not be used; the newest: %s: %s\n",
                  summary.rejected_count(), summary.last_rejection().reason(),
                  summary.last_rejection().message());
  }
  const v1::ContactFindings& findings = summary.findings();
  if (findings.distant_point_count() > 0) {
    absl::PrintF("%d points of contact are far from their object's surface, up to %.3g m\n",
                 findings.distant_point_count(), findings.largest_distance_m());
  }
  if (findings.zero_impulse_count() > 0) {
    absl::PrintF("%d contacts have no impulse\n", findings.zero_impulse_count());
  }
  if (summary.limited_frame_count() > 0) {
    absl::FPrintF(out,
                  "the limiter worked in %d frames; --full-scale-pa above %.4g would avoid it\n",
                  summary.limited_frame_count(), summary.peak_pa() * kHeadroom);
  }
}

/// Says how the file differs from the rendering that the summary describes.
void PrintFile(const RenderOptions& options, const RenderedFile& file) {
  std::FILE* const out = options.out == "-" ? stderr : stdout;
  if (file.factor() != 1) {
    absl::FPrintF(out, "the file has the sound times %.4g, with a peak of %s\n", file.factor(),
                  Decibels(file.clipped_count() > 0 ? 1.0 : file.peak()));
  }
  if (file.clipped_count() > 0) {
    absl::FPrintF(out,
                  "%d samples were clipped; a --gain up to %.3g, --normalize or --bits 32 would "
                  "avoid it\n",
                  file.clipped_count(), options.gain / file.peak());
  }
}

}  // namespace

v1::RenderSettings SettingsOf(const RenderOptions& options) {
  v1::RenderSettings settings;
  settings.set_sample_rate_hz(options.sample_rate_hz);
  settings.set_channel_count(options.channel_count);
  settings.set_tail_s(options.tail_s);
  if (options.full_scale_pa) settings.set_full_scale_pa(*options.full_scale_pa);
  return settings;
}

absl::Status EmptyTrace(const std::string& path) {
  return Refusal(absl::StatusCode::kInvalidArgument, "TRACE_EMPTY",
                 absl::StrCat(path,
                              ": holds no contact, so there is nothing to hear; "
                              "record a simulation in which something is struck"));
}

absl::Status Render(const client::Client& daemon, const RenderOptions& options, bool json) {
  ASSIGN_OR_RETURN(auto trace, client::ContactTraceReader::Open(options.trace));
  RenderedFile file({.path = options.out,
                     .format = {.sample_rate_hz = options.sample_rate_hz,
                                .channel_count = options.channel_count,
                                .bits = options.bits},
                     .factor = options.gain,
                     .normalize = options.normalize});
  const auto summary =
      daemon.Render(SettingsOf(options), trace,
                    [&](const client::AudioBlock& block) { return file.Take(block); });
  RETURN_IF_ERROR(file.status());
  if (!summary.ok()) return summary.status();
  RETURN_IF_ERROR(file.Finish());
  if (!file.begun()) return EmptyTrace(options.trace);
  if (json && options.out != "-") {
    PrintJson(*summary);
  } else {
    PrintSummary(options, *summary, options.sample_rate_hz);
    PrintFile(options, file);
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
