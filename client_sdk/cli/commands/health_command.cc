// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/health.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {

absl::Status ShowHealth(const client::Client& daemon, bool json) {
  ASSIGN_OR_RETURN(const std::vector<ServiceHealth> services, ReadHealth(daemon));
  std::vector<std::string> serving;
  std::vector<std::string> not_serving;
  for (const ServiceHealth& service : services) {
    (service.serves ? serving : not_serving).push_back(service.name);
    if (json) continue;
    absl::PrintF("%-33s%s\n", service.name, service.serves ? "SERVING" : "NOT_SERVING");
  }
  if (json) PrintJson({{"serving", serving}, {"not_serving", not_serving}});
  if (not_serving.empty()) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kFailedPrecondition, "NOT_SERVING",
      absl::StrCat("see what `carillon doctor` says about ", absl::StrJoin(not_serving, ", ")));
}

}  // namespace carillon::cli
