// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/job_progress.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "client_sdk/cli/output.h"

namespace carillon::cli {
namespace {

constexpr int kBarWidth = 30;

absl::string_view PhaseName(v1::Phase phase) {
  switch (phase) {
    case v1::PHASE_READ:
      return "reading";
    case v1::PHASE_MESH:
      return "meshing";
    case v1::PHASE_ASSEMBLE:
      return "assembling";
    case v1::PHASE_FACTOR:
      return "factorizing";
    case v1::PHASE_SOLVE:
      return "solving";
    case v1::PHASE_VERIFY:
      return "verifying";
    case v1::PHASE_WRITE:
      return "writing";
    case v1::PHASE_RADIATE:
      return "radiating";
    default:
      return "starting";
  }
}

absl::string_view Activity(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_QUEUED:
      return "waiting";
    case v1::JOB_STATE_SUCCEEDED:
      return "done";
    case v1::JOB_STATE_FAILED:
      return "failed";
    case v1::JOB_STATE_CANCELLED:
      return "cancelled";
    default:
      return PhaseName(job.progress().phase());
  }
}

double Fraction(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_SUCCEEDED ? 1.0 : job.progress().fraction();
}

std::string RoughTime(double seconds) {
  if (seconds < 100) return absl::StrFormat("%.0f s", seconds);
  return seconds < 6000 ? absl::StrFormat("%.0f min", seconds / 60)
                        : absl::StrFormat("%.1f h", seconds / 3600);
}

/// Redraws the line of the bar, which begins with the label of the job.
void DrawProgressBar(const v1::Job& job) {
  const int filled = static_cast<int>(std::lround(Fraction(job) * kBarWidth));
  absl::FPrintF(stderr, "\r\033[K%s  [%s%s]  %s", job.label(), std::string(filled, '#'),
                std::string(kBarWidth - filled, '.'), ProgressText(job));
}

}  // namespace

std::string ProgressText(const v1::Job& job) {
  std::string text = absl::StrFormat("%3.0f %%  %s", Fraction(job) * 100, Activity(job));
  const v1::Progress& progress = job.progress();
  if (progress.node_count() > 0)
    absl::StrAppend(&text, ", ", Counted(progress.node_count(), "node"));
  if (progress.converged_mode_count() > 0) {
    absl::StrAppend(&text, ", ", Counted(progress.converged_mode_count(), "mode"));
  }
  if (job.coarse_ready()) absl::StrAppend(&text, ", coarse model ready");
  if (progress.remaining_s() > 0) {
    absl::StrAppend(&text, ", ", RoughTime(progress.remaining_s()), " left");
  }
  return text;
}

absl::StatusOr<v1::Job> WatchWithProgress(const client::Client& daemon, const std::string& name) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  absl::string_view shown;
  auto job = daemon.WatchJob(name, [&](const v1::Job& state) {
    if (terminal) {
      DrawProgressBar(state);
    } else if (Activity(state) != shown) {
      shown = Activity(state);
      absl::FPrintF(stderr, "%s  %s\n", state.label(), ProgressText(state));
    }
  });
  if (terminal) absl::FPrintF(stderr, "\n");
  return job;
}

}  // namespace carillon::cli
