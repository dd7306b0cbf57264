// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/base/thread_annotations.h"
#include "carillon/v1/admin_service.grpc.pb.h"
#include "server/api/thread_pool.h"
#include "server/base/mutex.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// carillon.v1.AdminService. The constructor's references must outlive the service.
class AdminService final : public v1::AdminService::CallbackService {
 public:
  /// `token`: the token that callers from the network must send; empty: they are refused.
  AdminService(ModeDatabase& database, std::string token, ThreadPool& pool)
      : database_(database), token_(std::move(token)), pool_(pool) {}

  /// Replaces the token.
  void set_token(std::string token);

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
  mutable Mutex mutex_;
  std::string token_ ABSL_GUARDED_BY(mutex_);
  ThreadPool& pool_;
};

}  // namespace carillon
