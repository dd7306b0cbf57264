// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/client.h"

namespace carillon::cli {

/// Whether the daemon or one of its services is SERVING, as docs/troubleshoot.md describes it.
struct ServiceHealth {
  std::string name;  ///< "carillond" for the whole daemon
  std::string cure;  ///< what to do if it does not serve
  bool serves = false;
};

/// Asks the daemon for its health. Returns that of the whole daemon, and then that of each service.
/// Errors: those of Client::IsServing.
absl::StatusOr<std::vector<ServiceHealth>> ReadHealth(const client::Client& daemon);

}  // namespace carillon::cli
