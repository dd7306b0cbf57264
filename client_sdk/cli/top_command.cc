// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/job_progress.h"
#include "client_sdk/cli/message_json.h"
#include "client_sdk/cli/output.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr size_t kMostJobs = 8;

struct View {
  v1::GetMixerResponse mixer;
  std::vector<v1::Scene> scenes;
  std::vector<v1::Job> jobs;  // those that have not ended
};

absl::StatusOr<View> Look(const client::Client& daemon) {
  View view;
  ASSIGN_OR_RETURN(view.mixer, daemon.GetMixer());
  ASSIGN_OR_RETURN(view.scenes, daemon.ListScenes());
  v1::ListJobsRequest unfinished;
  unfinished.add_states(v1::JOB_STATE_QUEUED);
  unfinished.add_states(v1::JOB_STATE_RUNNING);
  ASSIGN_OR_RETURN(view.jobs, daemon.ListJobs(unfinished));
  return view;
}

template <class Messages>
std::string JsonList(const Messages& messages) {
  return absl::StrCat("[",
                      absl::StrJoin(messages, ",",
                                    [](std::string* out, const auto& message) {
                                      absl::StrAppend(out, MessageJson(message));
                                    }),
                      "]");
}

std::string Json(const View& view) {
  return absl::StrCat("{\"mixer\":", MessageJson(view.mixer), ",\"scenes\":", JsonList(view.scenes),
                      ",\"jobs\":", JsonList(view.jobs), "}\n");
}

std::string SceneLine(const v1::Scene& scene) {
  return absl::StrFormat("%-14s %7d %8d   %-12s gain %.4g%s%s\n", scene.name(),
                         scene.object_count(), scene.active_mode_count(), Decibels(scene.peak()),
                         scene.gain(), scene.muted() ? " muted" : "", scene.solo() ? " solo" : "");
}

std::string Text(const View& view, const std::string& server) {
  const v1::GetMixerResponse& mixer = view.mixer;
  std::string text =
      absl::StrFormat("carillond %s at %s, %s\n", mixer.version(), server, mixer.device());
  absl::StrAppendFormat(&text, "load %.1f %%, %s ringing, %s, gain %.4g%s\n", mixer.load() * 100,
                        Counted(mixer.active_mode_count(), "mode"),
                        Counted(mixer.object_count(), "object"), mixer.gain(),
                        mixer.muted() ? " muted" : "");
  absl::StrAppendFormat(&text, "peak %s, %s; limited %s, lost %d\n\n", Decibels(mixer.peak()),
                        Loudness(mixer.has_momentary_lufs(), mixer.momentary_lufs()),
                        Counted(mixer.limited_frame_count(), "frame"), mixer.lost_frame_count());
  absl::StrAppendFormat(&text, "%-14s %7s %8s   %s\n", "SCENE", "OBJECTS", "MODES", "PEAK");
  for (const v1::Scene& scene : view.scenes) text += SceneLine(scene);
  absl::StrAppendFormat(&text, "\n%s waiting or running\n", Counted(view.jobs.size(), "job"));
  for (size_t i = 0; i < std::min(view.jobs.size(), kMostJobs); ++i) {
    absl::StrAppend(&text, JobLine(view.jobs[i], absl::Now()), "\n");
  }
  return text;
}

}  // namespace

absl::Status Top(const client::Client& daemon, const std::string& server, const TopOptions& options,
                 const StopSignal& stop, bool json) {
  const bool redraws = !json && !options.once && isatty(STDOUT_FILENO) != 0;
  do {
    ASSIGN_OR_RETURN(const View view, Look(daemon));
    // Clears the screen before each view.
    absl::PrintF("%s%s", redraws ? "\x1b[H\x1b[2J" : "", json ? Json(view) : Text(view, server));
    if (std::fflush(stdout) != 0) break;  // the reader has gone
  } while (!options.once && !stop.ArrivesWithin(options.interval_s));
  return absl::OkStatus();
}

}  // namespace carillon::cli
