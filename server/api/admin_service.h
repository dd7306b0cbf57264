// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "carillon/v1/admin_service.grpc.pb.h"
#include "server/api/thread_pool.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// carillon.v1.AdminService. What it is given must outlive it.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  /// `token`: what callers from the network show; empty: they are refused.
  AdminService(ModeDatabase& database, std::string token, ThreadPool& pool)
      : database_(database), token_(std::move(token)), pool_(pool) {}

  grpc::ServerUnaryReactor* GetDatabaseStats(grpc::CallbackServerContext* context,
                                             const v1::GetDatabaseStatsRequest* request,
                                             v1::GetDatabaseStatsResponse* response) override;
  grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>* BackUpDatabase(
      grpc::CallbackServerContext* context, const v1::BackUpDatabaseRequest* request) override;
  grpc::ServerUnaryReactor* CollectGarbage(grpc::CallbackServerContext* context,
                                           const v1::CollectGarbageRequest* request,
                                           v1::CollectGarbageResponse* response) override;

 private:
  absl::Status Authorize(const grpc::CallbackServerContext& context) const;

  ModeDatabase& database_;
  const std::string token_;
  ThreadPool& pool_;
};

}  // namespace carillon
