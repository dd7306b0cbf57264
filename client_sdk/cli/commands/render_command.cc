// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/trace_page.h"
#include "client_sdk/cli/output/output.h"
#include "client_sdk/cli/output/rendered_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// -40 dB of full scale: a softer sound is rendered again before it is normalised.
constexpr double kSoft = 0.01;
/// -60 dB of full scale: a softer file is hardly heard.
constexpr double kFaint = 0.001;

/// Prints what the user should know about the sound.
void PrintFindings(const RenderOptions& options, const v1::RenderSummary& summary, std::FILE* out) {
  if (summary.paper_coupling_object_count() > 0) {
    absl::FPrintF(
        out,
        "%s sounding by the paper's coupling, whose levels are not physical, for lack of a "
        "transfer for the material: `carillon transfer` computes it, and so does --wait of "
        "`carillon "
        "render` and `carillon foley`\n",
        Counted(summary.paper_coupling_object_count(), "object"));
  }
  if (!options.normalize && summary.peak() > 0 && summary.peak() < kFaint) {
    absl::FPrintF(out, "the file peaks at %s; raise it by --gain or --normalize\n",
                  Decibels(summary.peak()));
  }
}

void PrintSummary(const RenderOptions& options, const v1::RenderSummary& summary,
                  uint32_t sample_rate_hz) {
  std::FILE* const out = options.out == "-" ? stderr : stdout;
  // EBU R 128 measures no sound of less than 0.4 s.
  const bool is_short = static_cast<double>(summary.frame_count()) < 0.4 * sample_rate_hz;
  const auto loudness = [is_short](bool present, double lufs) {
    return is_short ? "too short to measure" : Loudness(present, lufs);
  };
  absl::FPrintF(out, "%s: %.2f s, %s, peak %s\n", options.out,
                static_cast<double>(summary.frame_count()) / sample_rate_hz,
                Counted(summary.accepted_count(), "impulse"), Decibels(summary.peak()));
  absl::FPrintF(out,
                "%.3g Pa (full scale is %.4g Pa), true peak %s, whole file %s, loudest 0.4 s %s\n",
                summary.peak_pa(), summary.full_scale_pa(), Decibels(summary.true_peak()),
                loudness(summary.has_integrated_lufs(), summary.integrated_lufs()),
                loudness(summary.has_loudest_momentary_lufs(), summary.loudest_momentary_lufs()));
  for (const v1::Warning& warning : summary.warnings()) {
    absl::FPrintF(out, "%s: %s\n", warning.id(), warning.text());
  }
  PrintFindings(options, summary, out);
  if (summary.limited_frame_count() > 0) {
    absl::FPrintF(out, "the limiter worked in %s; --full-scale-pa above %.4g would avoid it\n",
                  Counted(summary.limited_frame_count(), "frame"),
                  summary.peak_pa() * kLimiterHeadroom);
  }
}

/// Says how the file differs from the rendering that the summary describes.
void PrintFile(const RenderOptions& options, const RenderedFile& file) {
  std::FILE* const out = options.out == "-" ? stderr : stdout;
  if (file.factor() != 1) {
    absl::FPrintF(out, "the file has the sound times %.4g\n", file.factor());
  }
  if (file.clipped_count() > 0) {
    absl::FPrintF(out,
                  "clipped: %s; a --gain up to %.3g, --normalize or --bits 32 would "
                  "avoid it\n",
                  Counted(file.clipped_count(), "sample"), options.gain / file.peak());
  }
  if (file.is_cut()) {
    absl::FPrintF(out, "the sound is longer than the file, and fades out over its last %.4g s\n",
                  options.fade_s);
  }
}

/// Prints the summary, the file, and the labels of the trace as JSON.
void PrintRenderingJson(const RenderOptions& options, const v1::RenderSummary& summary,
                        const RenderedFile& file, const v1::ContactTraceHeader& trace,
                        std::vector<JsonMember> members) {
  const double seconds = static_cast<double>(file.frame_count()) / options.sample_rate_hz;
  members.insert(members.begin(), {{"file", options.out},
                                   {"seconds", seconds},
                                   {"file_peak", double{file.peak()}},
                                   {"factor", file.factor()},
                                   {"clipped_sample_count", file.clipped_count()}});
  if (options.length_s) members.push_back({"cut", file.is_cut()});
  if (!trace.labels().empty()) {
    members.push_back({"labels", std::map<std::string, std::string>(trace.labels().begin(),
                                                                    trace.labels().end())});
  }
  absl::PrintF("%s\n", MessageJson(summary, members));
}

}  // namespace

absl::Status AwaitTransfers(AwaitedJobs& jobs, const std::vector<std::string>& traces) {
  std::map<std::string, v1::CreateTransferRequest> requests;
  for (const std::string& path : traces) {
    auto trace = client::ContactTraceReader::Open(path);
    while (trace.ok()) {
      const auto record = trace->Next();
      if (!record.ok() || !*record) break;
      const v1::ContactTraceObject& object = (*record)->object();
      if (!(*record)->has_object() || object.radiation() == v1::RADIATION_MODEL_PAPER_COUPLING) {
        continue;
      }
      v1::CreateTransferRequest request;
      request.set_modal_model(object.modal_model());
      *request.mutable_material() = object.material();
      request.set_size(object.size());
      requests.try_emplace(request.SerializeAsString(), request)
          .first->second.set_label(object.label());
    }
  }
  std::vector<std::string> unfinished;
  for (const auto& [key, request] : requests) {
    const absl::StatusOr<v1::Job> job = jobs.daemon().CreateTransfer(request);
    if (!job.ok() || job->state() == v1::JOB_STATE_SUCCEEDED) continue;
    unfinished.push_back(job->name());
    jobs.Add(job->name());
  }
  for (const std::string& job : unfinished) RETURN_IF_ERROR(jobs.Await(job).status());
  return absl::OkStatus();
}

v1::RenderSettings SettingsOf(const RenderOptions& options) {
  v1::RenderSettings settings;
  settings.set_sample_rate_hz(options.sample_rate_hz);
  settings.set_channel_count(options.channel_count);
  settings.set_tail_s(options.tail_s);
  if (options.full_scale_pa) settings.set_full_scale_pa(*options.full_scale_pa);
  if (options.length_s) settings.set_longest_s(*options.length_s);
  return settings;
}

RenderedForm FormOf(const RenderOptions& options, const std::string& path) {
  RenderedForm form{.path = path,
                    .format = {.sample_rate_hz = options.sample_rate_hz,
                               .channel_count = options.channel_count,
                               .bits = options.bits},
                    .factor = options.gain,
                    .normalize = options.normalize};
  if (options.length_s) {
    form.frame_count = std::llround(*options.length_s * options.sample_rate_hz);
    form.fade_frame_count = std::llround(options.fade_s * options.sample_rate_hz);
  }
  return form;
}

std::optional<double> BetterFullScale(const RenderOptions& options,
                                      const v1::RenderSummary& summary) {
  const double peak = summary.peak_pa() / summary.full_scale_pa();
  const bool soft = peak > 0 && peak < kSoft;
  const bool good = !soft && summary.limited_frame_count() == 0;
  if (!options.normalize || options.full_scale_pa || good) return std::nullopt;
  constexpr double kAbovePeak = 1.5;  // the limiter must not work
  return std::max(summary.peak_pa() * kAbovePeak, kLeastFullScale_pa);
}

absl::Status CheckHasContacts(const std::string& path, const v1::RenderSummary& summary) {
  for (const v1::Warning& warning : summary.warnings()) {
    if (warning.id() != "TRACE_EMPTY") continue;
    return Refusal(absl::StatusCode::kInvalidArgument, "TRACE_EMPTY",
                   absl::StrCat(path, ": ", warning.text()));
  }
  if (summary.rejected_count() == 0 || summary.accepted_count() > 0 || summary.peak_pa() > 0) {
    return absl::OkStatus();
  }
  v1::ErrorInfo error = summary.last_rejection();
  error.set_message(absl::StrCat("nothing sounds, because all contacts were rejected (",
                                 summary.rejected_count(),
                                 "), the last one so: ", error.message()));
  return FromErrorInfo(absl::StatusCode::kInvalidArgument, error);
}

absl::StatusOr<RenderOptions> Render(const client::Client& daemon, const RenderOptions& options,
                                     bool json, std::vector<JsonMember> members) {
  RenderedFile file(FormOf(options, options.out));
  v1::ContactTraceHeader header;
  RenderedTrace page{.trace = options.trace, .wave = options.out};
  const auto render = [&](const v1::RenderSettings& settings) -> absl::StatusOr<v1::RenderSummary> {
    ASSIGN_OR_RETURN(auto trace, client::ContactTraceReader::Open(options.trace));
    header = trace.header();
    page.blows.Clear();
    return daemon.Render(
        settings, trace, [&](const client::AudioBlock& block) { return file.Take(block); },
        [&](const v1::Blow& blow) { *page.blows.add_blows() = blow; });
  };
  v1::RenderSettings settings = SettingsOf(options);
  settings.set_tell_blows(!options.html.empty());
  auto summary = render(settings);
  // A trace that comes through a pipe cannot be read twice.
  const bool rereadable = std::filesystem::is_regular_file(options.trace);
  if (const auto better =
          summary.ok() && rereadable ? BetterFullScale(options, *summary) : std::nullopt) {
    file.Restart();
    settings.set_full_scale_pa(*better);
    summary = render(settings);
  }
  RETURN_IF_ERROR(file.status());
  if (!summary.ok()) return summary.status();
  RETURN_IF_ERROR(file.Finish());
  RETURN_IF_ERROR(CheckHasContacts(options.trace, *summary));
  file.Describe(*summary);
  if (!options.html.empty()) {
    page.summary = *summary;
    RETURN_IF_ERROR(WriteTracePage(daemon, page, options.html));
  }
  if (json) {
    PrintRenderingJson(options, *summary, file, header, std::move(members));
  } else {
    PrintSummary(options, *summary, options.sample_rate_hz);
    PrintFile(options, file);
  }
  RenderOptions alike = options;
  alike.normalize = false;
  alike.gain = file.factor();
  if (settings.has_full_scale_pa()) alike.full_scale_pa = settings.full_scale_pa();
  return alike;
}

}  // namespace carillon::cli
