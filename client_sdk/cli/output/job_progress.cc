// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/job_progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/program/escaped_text.h"

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

/// Returns the words for the running jobs that a job waits for.
std::string Running(const v1::JobWait& wait, absl::string_view before_several) {
  if (wait.running_job_count() != 1) {
    return absl::StrCat(before_several, Counted(wait.running_job_count(), "job"));
  }
  return wait.running_job_label().empty() ? "a job" : EscapedText(wait.running_job_label());
}

std::string WaitText(const v1::JobWait& wait) {
  if (wait.earlier_job_count() > 0) {
    return absl::StrCat("waiting: ", Counted(wait.earlier_job_count(), "job"),
                        wait.earlier_job_count() == 1 ? " is" : " are", " before it");
  }
  switch (wait.cause()) {
    case v1::WAIT_CAUSE_WORKER:
      return absl::StrCat("waiting for ", Running(wait, "one of "));
    case v1::WAIT_CAUSE_MEMORY:
      return absl::StrCat("waiting for the memory of ", Running(wait, ""));
    case v1::WAIT_CAUSE_COARSE_MODEL:
      return "waiting for its coarse model";
    default:
      return "waiting";
  }
}

std::string Activity(const v1::Job& job) {
  switch (job.state()) {
    case v1::JOB_STATE_QUEUED:
      return WaitText(job.wait());
    case v1::JOB_STATE_SUCCEEDED:
      return "done";
    case v1::JOB_STATE_FAILED:
      return "failed";
    case v1::JOB_STATE_CANCELLED:
      return "cancelled";
    default:
      return std::string(PhaseName(job.progress().phase()));
  }
}

double Fraction(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_SUCCEEDED ? 1.0 : job.progress().fraction();
}

/// Returns how long a job has been running, or the time since it was requested; empty if the daemon
/// does not report it.
std::string AgeText(const v1::Job& job, absl::Time now) {
  const bool runs = job.started_unix_ms() > 0;
  const int64_t since_unix_ms = runs ? job.started_unix_ms() : job.created_unix_ms();
  if (since_unix_ms == 0) return "";
  // The clock of this machine may be behind the daemon's.
  const double age_s =
      std::max(0.0, absl::ToDoubleSeconds(now - absl::FromUnixMillis(since_unix_ms)));
  return runs ? absl::StrCat(", running for ", RoughTime(age_s))
              : absl::StrCat(", requested ", RoughTime(age_s), " ago");
}

/// Redraws the line of the bar, which begins with the label of the job.
void DrawProgressBar(const v1::Job& job) {
  const int filled = static_cast<int>(std::lround(Fraction(job) * kBarWidth));
  absl::FPrintF(stderr, "\r\033[K%s  [%s%s]  %s", EscapedText(job.label()),
                std::string(filled, '#'), std::string(kBarWidth - filled, '.'), ProgressText(job));
}

}  // namespace

absl::string_view ShortName(const v1::Job& job) {
  return absl::StripPrefix(job.name(), "jobs/").substr(0, 12);
}

std::string ProgressText(const v1::Job& job) {
  std::string text = absl::StrFormat("%3.0f %%  %s", Fraction(job) * 100, Activity(job));
  const v1::Progress& progress = job.progress();
  if (progress.extent_m() > 0) absl::StrAppendFormat(&text, ", %.3g m across", progress.extent_m());
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

std::string JobLine(const v1::Job& job, absl::Time now) {
  const bool failed = job.state() == v1::JOB_STATE_FAILED;
  const std::string reason = failed ? absl::StrCat(": ", job.error().reason()) : "";
  return absl::StrCat(ShortName(job), "  ", ProgressText(job), reason, AgeText(job, now), "  ",
                      EscapedText(job.label()));
}

std::string RoughTime(double seconds) {
  if (seconds < 100) return absl::StrFormat("%.0f s", seconds);
  if (seconds < 6000) return absl::StrFormat("%.0f min", seconds / 60);
  return seconds < 360'000 ? absl::StrFormat("%.1f h", seconds / 3600)
                           : absl::StrFormat("%.0f days", seconds / 86'400);
}

absl::StatusOr<v1::Job> WatchWithProgress(const client::Client& daemon, const std::string& name,
                                          const std::function<void(const v1::Job&)>& on_state) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  std::string shown;
  auto job = daemon.WatchJob(name, [&](const v1::Job& state) {
    if (on_state) on_state(state);
    if (terminal) {
      DrawProgressBar(state);
    } else if (Activity(state) != shown) {
      shown = Activity(state);
      absl::FPrintF(stderr, "%s  %s\n", EscapedText(state.label()), ProgressText(state));
    }
  });
  if (terminal) absl::FPrintF(stderr, "\n");
  return job;
}

}  // namespace carillon::cli
