// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "server/api/call/reception.h"
#include "server/decomposition/decomposition_queue.h"

namespace carillon {

/// carillon.v1.DecompositionService. The objects that the constructor gets by reference must
/// outlive the service.
class DecompositionService final : public v1::DecompositionService::CallbackService {
 public:
  /// The pool of `writing` runs the calls that change the database.
  DecompositionService(DecompositionQueue& queue, const Reception& reception,
                       const Reception& writing)
      : queue_(queue), reception_(reception), writing_(writing) {}

  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const v1::GetJobRequest* request,
                                   v1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1::CancelJobRequest* request,
                                      v1::CancelJobResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(
      grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) override;
  grpc::ServerWriteReactor<v1::WatchJobsResponse>* WatchJobs(
      grpc::CallbackServerContext* context, const v1::WatchJobsRequest* request) override;

 private:
  DecompositionQueue& queue_;
  const Reception reception_;
  const Reception writing_;
};

}  // namespace carillon
