// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/doctor_command.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client_sdk/cli/daemon_process.h"
#include "client_sdk/cli/daemon_settings.h"
#include "client_sdk/cli/findings.h"
#include "client_sdk/cli/health.h"
#include "client_sdk/cli/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr uint64_t kEnoughDescriptors = 1024;
constexpr double kHighLoad = 0.7;
constexpr absl::Duration kEnoughTime = absl::Hours(30 * 24);
/// The doctor watches the sound for this time where frames were lost before.
constexpr absl::Duration kWatchedTime = absl::Seconds(2);
/// The time within which a daemon must have sent something, however busy it is.
constexpr std::chrono::seconds kMuteTime(5);

std::string Text(const absl::Status& status) { return std::string(status.message()); }

void CheckProcess(const Program& program, Findings& findings) {
  absl::string_view path = program.server;
  if (!absl::ConsumePrefix(&path, "unix:")) {
    return findings.Unknown("real time", "run this on the daemon's machine, over its Unix socket");
  }
  const absl::StatusOr<pid_t> process = ProcessAt(std::string(path));
  if (!process.ok()) return findings.Bad("socket", Text(process.status()));
  findings.Good("socket", absl::StrCat(ProcessName(*process), " listens at ", path));
  const std::optional<bool> realtime = HasRealtimeThread(*process);
  if (!realtime) {
    findings.Unknown("real time", "this user cannot see the daemon's threads");
  } else if (*realtime) {
    findings.Good("real time", "the render thread has real-time priority");
  } else {
    findings.Bad("real time",
                 "the render thread has no real-time priority, and may drop out on a busy machine: "
                 "set LimitRTPRIO= in its unit, or rtprio in /etc/security/limits.conf");
  }
  const std::optional<uint64_t> limit = DescriptorLimit(*process);
  if (!limit) return;
  if (*limit >= kEnoughDescriptors) {
    return findings.Good("limits", Counted(*limit, "descriptor"));
  }
  findings.Bad("limits", absl::StrCat("the daemon may open ", Counted(*limit, "descriptor"),
                                      ", a connection needs one: raise LimitNOFILE="));
}

/// Returns the number of frames that were lost since `before`, after waiting a little if some were
/// lost at all.
uint64_t FramesLostNow(const client::Client& daemon, const v1::GetMixerResponse& before) {
  if (before.lost_frame_count() == 0) return 0;
  absl::SleepFor(kWatchedTime);
  const auto after = daemon.GetMixer();
  return after.ok() ? after->lost_frame_count() - before.lost_frame_count() : 0;
}

/// Returns the health of the daemon. A daemon that does not tell it counts as one that serves.
Health CheckHealth(const client::Client& daemon, Findings& findings) {
  const absl::StatusOr<Health> health = ReadHealth(daemon);
  if (!health.ok()) {
    findings.Unknown("health", Text(health.status()));
    return {.daemon = true, .audio = true, .models = true, .decompositions = true};
  }
  const std::vector<ServiceHealth> services = ServicesOf(*health);
  if (!health->daemon) {
    findings.Bad("health",
                 "carillond is NOT_SERVING, because it is stopping: start it again if nobody else "
                 "does");
  } else if (std::ranges::all_of(services, &ServiceHealth::serves)) {
    findings.Good("health", "every service is SERVING");
  }
  return *health;
}

void CheckSound(const client::Client& daemon, const v1::GetMixerResponse& mixer, bool serves,
                Findings& findings) {
  if (!mixer.device_message().empty()) {
    findings.Bad("sound", absl::StrCat("plays on ", mixer.device(), ": ", mixer.device_message()));
  } else if (!serves) {
    findings.Bad("sound", absl::StrCat("carillon.v1.AudioService is NOT_SERVING, and plays on ",
                                       mixer.device(),
                                       ": the wanted device does not play or take the sound: see "
                                       "the daemon's log"));
  } else if (mixer.device() == "null") {
    findings.Unknown("sound", "plays on null, to nobody but `carillon listen`: see --audio-device");
  } else {
    findings.Good("sound", absl::StrFormat("plays on %s, %.1f ms behind", mixer.device(),
                                           1e3 * mixer.output_latency_s()));
  }
  const uint64_t lost_now = FramesLostNow(daemon, mixer);
  const std::string load = absl::StrFormat(
      "rendering takes %.0f %% of the time, with %s lost since the daemon began, %d of them just "
      "now",
      100 * mixer.load(), Counted(mixer.lost_frame_count() + lost_now, "frame"), lost_now);
  if (mixer.load() > kHighLoad) {
    return findings.Bad("load", load + ": use fewer objects, or a faster processor");
  }
  if (lost_now > 0) {
    return findings.Bad("load", load + ": raise --look-ahead-blocks, or see real time above");
  }
  findings.Good("load", load);
}

void CheckDatabase(const client::Client& daemon, bool serves, Findings& findings) {
  if (!serves) {
    return findings.Bad(
        "database",
        "carillon.v1.ModalModelService is NOT_SERVING, because the database cannot be changed; the "
        "daemon's log says why. If the disk is full or fails, or another process holds the "
        "database, remedy that. If the database's file or its -wal file was removed, replaced, "
        "truncated or overwritten, stop the daemon, put the file back or run `carillond db "
        "restore`, and start the daemon again");
  }
  const auto stats = daemon.GetDatabaseStats();
  if (absl::IsPermissionDenied(stats.status()) || absl::IsUnauthenticated(stats.status())) {
    return findings.Unknown("database", Text(stats.status()));
  }
  if (!stats.ok()) return findings.Bad("database", Text(stats.status()));
  const std::string content = absl::StrCat(Counted(stats->model_count(), "model"), ", ",
                                           stats->file_bytes() >> 20U, " MiB");
  if (stats->quarantined_count() == 0) return findings.Good("database", content);
  findings.Bad("database",
               absl::StrCat(content, ", ", Counted(stats->quarantined_count(), "damaged model"),
                            ": check the disk, and run `carillond db "
                            "check` while the daemon is stopped"));
}

/// Runs a program for at most five seconds. Whether it ended well.
bool Succeeds(const std::vector<std::string>& command) {
  ChildCommand child{.words = {"timeout", "5"}};
  child.words.insert(child.words.end(), command.begin(), command.end());
  absl::StatusOr<ChildProcess> process = ChildProcess::Start(child);
  if (!process.ok()) return false;
  const ProcessEnd end = process->Wait();
  return end.exited && end.status == 0;
}

void CheckWorkers(const Health& health, Findings& findings) {
  if (!health.decompositions) {
    return findings.Bad(
        "workers",
        absl::StrCat("carillon.v1.DecompositionService is NOT_SERVING, because ",
                     health.models
                         ? "the daemon cannot execute its carillon-precompute, or cannot use the "
                           "folder work in its data folder; decompositions_impossible in the "
                           "daemon's log says which. Put that program back, or give the path of "
                           "another with --precompute and restart the daemon (`carillond "
                           "--print-config` prints the path in force); or remove what is in place "
                           "of the folder, or free space"
                         : "a model has no place in the database: see the database above"));
  }
  const std::filesystem::path beside =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename("carillon-precompute");
  if (Succeeds({beside, "--version"}) || Succeeds({"carillon-precompute", "--version"})) {
    return findings.Good("workers",
                         "the daemon finds its carillon-precompute, and the installed one runs");
  }
  // The daemon may have been given another one.
  findings.Unknown("workers",
                   absl::StrCat("the daemon finds its carillon-precompute, but none runs here, "
                                "neither as ",
                                beside.string(),
                                " nor from PATH: if models cannot be computed, install it anew"));
}

/// Finds the newest job that failed because of its worker.
void CheckJobs(const client::Client& daemon, Findings& findings) {
  const auto jobs = daemon.ListJobs();
  if (!jobs.ok()) return;
  for (const v1::Job& job : *jobs) {
    if (!absl::StartsWith(job.error().reason(), "WORKER_")) continue;
    // Whatever was the cause may have gone meanwhile.
    return findings.Unknown(
        "jobs", absl::StrCat(job.name(), " failed: ", job.error().message(), "; ask for it again"));
  }
}

/// Finds nothing about Slurm where the daemon does not use it.
void CheckSlurm(const client::Client& daemon, Findings& findings) {
  const auto info = daemon.GetServerInfo();
  if (!info.ok() || std::ranges::count(info->features(), "slurm") == 0) return;
  if (Succeeds({"sinfo", "--noheader"})) return findings.Good("slurm", "the cluster answers");
  findings.Unknown("slurm",
                   "sinfo does not answer here, and the daemon runs its decompositions on the "
                   "cluster: see that slurmctld runs");
}

void CheckTls(const Program& program, const client::Client& daemon, Findings& findings) {
  if (!program.tls_roots_file.empty() && !absl::StartsWith(program.server, "unix:")) {
    return findings.Good(
        "tls", absl::StrCat("the daemon's certificate is vouched for by ", program.tls_roots_file));
  }
  if (IsOnThisMachine(program.server)) {
    const auto info = daemon.GetServerInfo();
    const bool serves_tls = info.ok() && info->certificate_end_unix_s() != 0;
    return findings.Good(
        "tls", serves_tls ? "the daemon serves TLS over TCP, and its Unix socket needs none"
                          : "not needed, because only this machine reaches the daemon");
  }
  findings.Bad("tls",
               "without --tls-roots the network reads along, and tokens are sent for all to see: "
               "name the certificate that vouches for the daemon");
}

void CheckCertificates(const client::Client& daemon, Findings& findings) {
  const auto info = daemon.GetServerInfo();
  if (!info.ok() || info->certificate_end_unix_s() == 0) return;
  const absl::Time end = absl::FromUnixSeconds(info->certificate_end_unix_s());
  const std::string when = absl::FormatTime(
      "a certificate of the daemon expires on %Y-%m-%d %H:%M UTC", end, absl::UTCTimeZone());
  if (end - absl::Now() > kEnoughTime) return findings.Good("expiry", when);
  findings.Bad("expiry",
               absl::StrCat(when,
                            ", and clients refuse it then: put a new one in its file, and "
                            "reload the daemon (systemctl reload carillond)"));
}

/// Finds nothing about the settings of a daemon that is reached over TCP.
void CheckSettings(const Program& program, Findings& findings) {
  absl::string_view path = program.server;
  if (!absl::ConsumePrefix(&path, "unix:")) return;
  const absl::StatusOr<pid_t> process = ProcessAt(std::string(path));
  if (!process.ok()) return;
  // The number is zero for a process in another PID namespace.
  const auto checked = *process == 0 ? std::nullopt : CheckSettingsOf(*process);
  if (!checked) {
    findings.Unknown("settings",
                     "run this as the daemon's user, where the daemon runs, to have its settings "
                     "and the files that they name checked as at a start (runuser -u carillon -- "
                     "carillon doctor)");
  } else if (checked->ok()) {
    findings.Good("settings", "a start would accept the settings and the files that they name");
  } else {
    findings.Bad("settings",
                 absl::StrCat("the daemon runs, but would not start again: ", Text(*checked)));
  }
}

/// Returns whether the process at the daemon's socket answers at all. A call would wait for 20 s.
bool CheckAnswers(const Program& program, Findings& findings) {
  absl::string_view path = program.server;
  if (!absl::ConsumePrefix(&path, "unix:") || !IsMute(std::string(path), kMuteTime)) return true;
  CheckProcess(program, findings);
  findings.Bad("daemon",
               absl::StrCat("the process at ", path, " has sent nothing for ", kMuteTime.count(),
                            " s: it is stopped, hangs, or is not carillond: see which it "
                            "is (ss -xlp), end it, and start carillond again"));
  return false;
}

void CheckDaemon(const Program& program, Findings& findings) {
  if (!CheckAnswers(program, findings)) return;
  const auto daemon = program.Daemon();
  const auto mixer = daemon->GetMixer();
  CheckProcess(program, findings);
  CheckSettings(program, findings);
  if (!mixer.ok()) return findings.Bad("daemon", Text(mixer.status()));
  const bool same = mixer->version() == CARILLON_VERSION;
  const std::string version = absl::StrCat("carillond ", mixer->version(), " at ", program.server);
  same ? findings.Good("daemon", version)
       : findings.Bad("daemon", absl::StrCat(version, ", but this is carillon ", CARILLON_VERSION,
                                             ": restart the daemon after an upgrade"));
  const Health health = CheckHealth(*daemon, findings);
  CheckSound(*daemon, *mixer, health.audio, findings);
  CheckDatabase(*daemon, health.models, findings);
  CheckWorkers(health, findings);
  CheckJobs(*daemon, findings);
  CheckSlurm(*daemon, findings);
  CheckTls(program, *daemon, findings);
  CheckCertificates(*daemon, findings);
}

absl::Status Conclude(const Findings& findings) {
  if (findings.fault_count() == 0) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "FAULTS_FOUND",
                 absl::StrCat("see the findings that are a FAULT, of which there are ",
                              findings.fault_count()));
}

}  // namespace

absl::Status Diagnose(const Program& program) {
  Findings findings;
  CheckDaemon(program, findings);
  std::cout << (program.json ? findings.ToJson() : findings.ToText()) << std::flush;
  return Conclude(findings);
}

}  // namespace carillon::cli
