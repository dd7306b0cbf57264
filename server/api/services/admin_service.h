// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/admin_service.grpc.pb.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/reception.h"
#include "server/api/edge/idle_calls.h"
#include "server/base/clock.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// The parts of the daemon that the calls of administrators use.
struct AdminContext {
  ModeDatabase& database;
  Reception reception;
  Reception writing;     ///< its pool runs the calls that change the database
  Reception background;  ///< its pool sends the backups
  FairTurns& copying;    ///< makes the copies that are sent
  IdleCalls& idle_calls;
  const Clock& clock;
};

/// carillon.v1.AdminService. The objects that the constructor gets by reference must outlive the
/// service.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  explicit AdminService(const AdminContext& daemon) : daemon_(daemon) {}

  grpc::ServerUnaryReactor* GetDatabaseStats(grpc::CallbackServerContext* context,
                                             const v1::GetDatabaseStatsRequest* request,
                                             v1::GetDatabaseStatsResponse* response) override;
  grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>* BackUpDatabase(
      grpc::CallbackServerContext* context, const v1::BackUpDatabaseRequest* request) override;
  grpc::ServerUnaryReactor* CollectGarbage(grpc::CallbackServerContext* context,
                                           const v1::CollectGarbageRequest* request,
                                           v1::CollectGarbageResponse* response) override;

 private:
  absl::Status Collect(const v1::CollectGarbageRequest& request, const Principal& caller,
                       v1::CollectGarbageResponse& response);

  const AdminContext daemon_;
};

}  // namespace carillon
