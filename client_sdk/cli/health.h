// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "carillon/client.h"

namespace carillon::cli {

/// The health of the daemon, as docs/operations.md describes it.
struct Health {
  bool daemon = false;          ///< of the whole daemon
  bool audio = false;           ///< of carillon.v1.AudioService
  bool models = false;          ///< of carillon.v1.ModalModelService
  bool decompositions = false;  ///< of carillon.v1.DecompositionService
};

/// Whether one service, or the whole daemon, is SERVING.
struct ServiceHealth {
  std::string name;  ///< "carillond" for the whole daemon
  bool serves = false;
};

/// Asks the daemon for its health. Errors: those of Client::IsServing.
absl::StatusOr<Health> ReadHealth(const client::Client& daemon);

/// Returns the health of the whole daemon, and then that of each service.
std::vector<ServiceHealth> ServicesOf(const Health& health);

}  // namespace carillon::cli
