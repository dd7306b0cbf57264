// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/health.h"

#include "proto/cpp/status_macros.h"

namespace carillon::cli {

absl::StatusOr<std::vector<ServiceHealth>> ReadHealth(const client::Client& daemon) {
  std::vector<ServiceHealth> services = {
      {.name = "carillond", .cure = "it is stopping: start it again if nobody else does"},
      {.name = "carillon.v1.AudioService",
       .cure = "the wanted device does not play or take the sound: see `carillon status` and the "
               "daemon's log"},
      {.name = "carillon.v1.ModalModelService",
       .cure = "the database cannot be changed; the daemon's log says why. If the disk is full or "
               "fails, remedy that. If the database's file was moved or overwritten, stop the "
               "daemon, put the file back or run `carillond db restore`, and start it again"},
      {.name = "carillon.v1.DecompositionService",
       .cure = "the daemon cannot run its carillon-precompute, cannot use the folder work in its "
               "data folder, or cannot change its database; decompositions_impossible in its log "
               "says which"}};
  for (ServiceHealth& service : services) {
    ASSIGN_OR_RETURN(service.serves,
                     daemon.IsServing(&service == &services.front() ? "" : service.name));
  }
  return services;
}

}  // namespace carillon::cli
