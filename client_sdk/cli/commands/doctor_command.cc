// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/doctor_command.h"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/reason_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// The share of frames that the limiter may lower before it is worth a note.
constexpr double kMuchLimited = 0.01;

struct Finding {
  std::string verdict;  ///< OK, NOTE or FAULT
  std::string subject;
  std::string text;
  std::string id{};  ///< its row of docs/troubleshoot.md; empty without one
};

/// The whole daemon or one of its services.
struct Subject {
  std::string service;  ///< empty for the whole daemon
  std::string finding;  ///< the row of docs/troubleshoot.md if it does not serve
};

const std::vector<Subject>& Subjects() {
  static const auto& subjects =
      *new std::vector<Subject>{{"", "DAEMON_STOPPING"},
                                {"carillon.v1.AudioService", "AUDIO_NOT_SERVING"},
                                {"carillon.v1.ModalModelService", "MODELS_NOT_SERVING"},
                                {"carillon.v1.DecompositionService", "DECOMPOSITIONS_NOT_SERVING"}};
  return subjects;
}

/// Returns a finding with what docs/troubleshoot.md says about it: what it is, and what to do.
Finding OnPage(const std::string& verdict, const std::string& subject, const std::string& id,
               const std::string& fact) {
  const absl::StatusOr<CatalogueReason> row = FindReason(id);
  if (!row.ok()) return {verdict, subject, std::string(row.status().message()), id};
  return {verdict, subject, absl::StrCat(fact, ": ", row->meaning, "; ", row->repair), id};
}

absl::Status CheckHealth(const client::Client& daemon, std::vector<Finding>& findings) {
  for (const Subject& subject : Subjects()) {
    ASSIGN_OR_RETURN(const bool serves, daemon.IsServing(subject.service));
    const std::string name = subject.service.empty() ? "carillond" : subject.service;
    findings.push_back(serves ? Finding{"OK", name, "is SERVING"}
                              : OnPage("FAULT", name, subject.finding, "is NOT_SERVING"));
  }
  return absl::OkStatus();
}

/// Finds why nothing, or not all, is heard of a daemon that serves.
void CheckOutput(const v1::GetMixerResponse& mixer, std::vector<Finding>& findings) {
  const auto note = [&](const std::string& id, const std::string& fact) {
    findings.push_back(OnPage("NOTE", "sound", id, fact));
  };
  if (!mixer.device_message().empty()) note("DEVICE_NOT_PLAYING", mixer.device_message());
  if (mixer.muted() || mixer.gain() == 0) note("OUTPUT_MUTED", "nothing is heard");
  if (mixer.lost_frame_count() > 0) {
    note("FRAMES_LOST", absl::StrCat(mixer.lost_frame_count(), " frames were not heard"));
  }
  const double limited_fraction = static_cast<double>(mixer.limited_frame_count()) /
                                  static_cast<double>(std::max<uint64_t>(1, mixer.frame_count()));
  if (limited_fraction > kMuchLimited) {
    note("LIMITER_WORKS", absl::StrFormat("%.0f %% of all frames", 100 * limited_fraction));
  }
  if (mixer.merged_impulse_count() + mixer.shed_impulse_count() + mixer.shed_object_count() > 0) {
    note("WORK_LEFT_OUT",
         absl::StrFormat("%d impulses were merged, %d left out, and %d objects silenced",
                         mixer.merged_impulse_count(), mixer.shed_impulse_count(),
                         mixer.shed_object_count()));
  }
}

/// Finds scenes that are not heard. A caller who may not list scenes finds none.
void CheckScenes(const client::Client& daemon, std::vector<Finding>& findings) {
  const auto scenes = daemon.ListScenes();
  if (!scenes.ok()) return;
  const bool has_solo = std::ranges::any_of(*scenes, &v1::Scene::solo);
  for (const v1::Scene& scene : *scenes) {
    const bool is_silent = scene.muted() || scene.gain() == 0 || (has_solo && !scene.solo());
    if (is_silent) findings.push_back(OnPage("NOTE", scene.name(), "SCENE_MUTED", "is not heard"));
  }
}

std::string FindingsJson(const std::vector<Finding>& findings, int64_t fault_count) {
  nlohmann::ordered_json json = {{"fault_count", fault_count},
                                 {"findings", nlohmann::ordered_json::array()}};
  for (const Finding& finding : findings) {
    json["findings"].push_back(
        {{"subject", finding.subject}, {"verdict", finding.verdict}, {"text", finding.text}});
    if (!finding.id.empty()) json["findings"].back()["id"] = finding.id;
  }
  return json.dump();
}

}  // namespace

absl::Status Diagnose(const client::Client& daemon, bool json) {
  std::vector<Finding> findings;
  RETURN_IF_ERROR(CheckHealth(daemon, findings));
  ASSIGN_OR_RETURN(const v1::GetMixerResponse mixer, daemon.GetMixer());
  CheckOutput(mixer, findings);
  CheckScenes(daemon, findings);
  const int64_t fault_count = std::ranges::count(findings, "FAULT", &Finding::verdict);
  if (json) absl::PrintF("%s\n", FindingsJson(findings, fault_count));
  for (const Finding& finding : findings) {
    if (json) break;
    absl::PrintF("%-5s  %-33s  %s\n", finding.verdict, finding.subject, finding.text);
  }
  if (fault_count == 0) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "NOT_SERVING",
      absl::StrCat("see the findings that are a FAULT, of which there are ", fault_count));
}

}  // namespace carillon::cli
