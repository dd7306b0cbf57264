// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/admin_service.grpc.pb.h"
#include "server/api/idle_calls.h"
#include "server/api/reception.h"
#include "server/base/clock.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// carillon.v1.AdminService. The objects that the constructor gets by reference must outlive the
/// service.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  /// The pool of `writing` runs the calls that change the database, and that of `background` makes
  /// the backups.
  AdminService(ModeDatabase& database, const Reception& reception, const Reception& writing,
               const Reception& background, IdleCalls& idle_calls, const Clock& clock)
      : database_(database),
        reception_(reception),
        writing_(writing),
        background_(background),
        idle_calls_(idle_calls),
        clock_(clock) {}

  grpc::ServerUnaryReactor* GetDatabaseStats(grpc::CallbackServerContext* context,
                                             const v1::GetDatabaseStatsRequest* request,
                                             v1::GetDatabaseStatsResponse* response) override;
  grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>* BackUpDatabase(
      grpc::CallbackServerContext* context, const v1::BackUpDatabaseRequest* request) override;
  grpc::ServerUnaryReactor* CollectGarbage(grpc::CallbackServerContext* context,
                                           const v1::CollectGarbageRequest* request,
                                           v1::CollectGarbageResponse* response) override;

 private:
  ModeDatabase& database_;
  const Reception reception_;
  const Reception writing_;
  const Reception background_;
  IdleCalls& idle_calls_;
  const Clock& clock_;
};

}  // namespace carillon
