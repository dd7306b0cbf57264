// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/doctor_command.h"

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

/// The whole daemon or one of its services, as docs/troubleshoot.md describes it.
struct Subject {
  std::string service;  ///< empty for the whole daemon
  std::string cure;     ///< what to do if it does not serve
};

const std::vector<Subject>& Subjects() {
  static const auto& subjects = *new std::vector<Subject>{
      {"", "it is stopping: start it again if nobody else does"},
      {"carillon.v1.AudioService",
       "the wanted device does not play or take the sound: see `carillon status` and the daemon's "
       "log"},
      {"carillon.v1.ModalModelService",
       "the database cannot be changed; the daemon's log says why. If the disk is full or fails, "
       "remedy that. If the database's file was moved or overwritten, stop the daemon, put the "
       "file back or run `carillond db restore`, and start it again"},
      {"carillon.v1.DecompositionService",
       "the daemon cannot run its carillon-precompute, cannot use the folder work in its data "
       "folder, or cannot change its database; decompositions_impossible in its log says which"}};
  return subjects;
}

}  // namespace

absl::Status Diagnose(const client::Client& daemon, bool json) {
  int fault_count = 0;
  nlohmann::ordered_json findings = nlohmann::ordered_json::array();
  for (const Subject& subject : Subjects()) {
    ASSIGN_OR_RETURN(const bool serves, daemon.IsServing(subject.service));
    const std::string name = subject.service.empty() ? "carillond" : subject.service;
    const std::string verdict = serves ? "OK" : "FAULT";
    const std::string text = serves ? "is SERVING" : "is NOT_SERVING: " + subject.cure;
    if (!serves) ++fault_count;
    findings.push_back({{"subject", name}, {"verdict", verdict}, {"text", text}});
    if (!json) absl::PrintF("%-5s  %-33s  %s\n", verdict, name, text);
  }
  if (json) {
    const nlohmann::ordered_json told = {{"fault_count", fault_count}, {"findings", findings}};
    absl::PrintF("%s\n", told.dump());
  }
  if (fault_count == 0) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "NOT_SERVING",
      absl::StrCat("see the findings that are a FAULT, of which there are ", fault_count));
}

}  // namespace carillon::cli
