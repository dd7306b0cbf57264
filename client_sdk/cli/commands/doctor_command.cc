// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/doctor_command.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/commands/health.h"
#include "client_sdk/cli/commands/running_daemon.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

struct Finding {
  std::string verdict;  ///< OK, FAULT or UNKNOWN
  std::string subject;
  std::string text;
};

std::string Text(const absl::Status& status) { return std::string(status.message()); }

/// Finds whether the daemon at a Unix socket would start again with its settings.
Finding CheckSettings(const std::string& socket_path) {
  const absl::StatusOr<pid_t> process = ProcessAt(socket_path);
  if (!process.ok()) return {"FAULT", "socket", Text(process.status())};
  const auto checked = *process == 0 ? std::nullopt : CheckSettingsOf(*process);
  if (!checked) {
    return {"UNKNOWN", "settings",
            "run this as the daemon's user, where the daemon runs (runuser -u carillon -- carillon "
            "doctor), or run `carillond --check-config` there"};
  }
  if (checked->ok()) {
    return {"OK", "settings", "a start would accept the settings and the files that they name"};
  }
  return {"FAULT", "settings",
          absl::StrCat("the daemon runs, but would not start again: ", Text(*checked))};
}

void CheckHealth(const Program& program, std::vector<Finding>& findings) {
  const auto services = ReadHealth(*program.Daemon());
  if (!services.ok()) {
    findings.push_back({"FAULT", "carillond", Text(services.status())});
    return;
  }
  for (const ServiceHealth& service : *services) {
    findings.push_back({service.serves ? "OK" : "FAULT", service.name,
                        service.serves ? "is SERVING" : "is NOT_SERVING: " + service.cure});
  }
}

std::vector<Finding> Examine(const Program& program) {
  std::vector<Finding> findings;
  absl::string_view path = program.server;
  if (absl::ConsumePrefix(&path, "unix:")) {
    findings.push_back(CheckSettings(std::string(path)));
    // A call would wait for 20 s for a daemon that is not there.
    if (findings.front().subject == "socket") return findings;
  }
  CheckHealth(program, findings);
  return findings;
}

std::string FindingsJson(const std::vector<Finding>& findings, int64_t fault_count) {
  nlohmann::ordered_json json = {{"fault_count", fault_count},
                                 {"findings", nlohmann::ordered_json::array()}};
  for (const Finding& finding : findings) {
    json["findings"].push_back(
        {{"subject", finding.subject}, {"verdict", finding.verdict}, {"text", finding.text}});
  }
  // A path may have any bytes.
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

absl::Status Diagnose(const Program& program) {
  const std::vector<Finding> findings = Examine(program);
  const int64_t fault_count = std::ranges::count(findings, "FAULT", &Finding::verdict);
  if (program.json) absl::PrintF("%s\n", FindingsJson(findings, fault_count));
  for (const Finding& finding : findings) {
    if (program.json) break;
    absl::PrintF("%-7s  %-33s  %s\n", finding.verdict, finding.subject, finding.text);
  }
  if (fault_count == 0) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "NOT_SERVING",
      absl::StrCat("see the findings that are a FAULT, of which there are ", fault_count));
}

}  // namespace carillon::cli
