// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/health.h"

#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr char kAudio[] = "carillon.v1.AudioService";
constexpr char kModels[] = "carillon.v1.ModalModelService";
constexpr char kDecompositions[] = "carillon.v1.DecompositionService";

}  // namespace

absl::StatusOr<Health> ReadHealth(const client::Client& daemon) {
  Health health;
  ASSIGN_OR_RETURN(health.daemon, daemon.IsServing(""));
  ASSIGN_OR_RETURN(health.audio, daemon.IsServing(kAudio));
  ASSIGN_OR_RETURN(health.models, daemon.IsServing(kModels));
  ASSIGN_OR_RETURN(health.decompositions, daemon.IsServing(kDecompositions));
  return health;
}

std::vector<ServiceHealth> ServicesOf(const Health& health) {
  return {{.name = "carillond", .serves = health.daemon},
          {.name = kAudio, .serves = health.audio},
          {.name = kModels, .serves = health.models},
          {.name = kDecompositions, .serves = health.decompositions}};
}

}  // namespace carillon::cli
