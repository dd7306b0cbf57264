// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/worker/v1/job_run_service.grpc.pb.h"
#include "server/api/call/raw_service.h"
#include "server/api/call/thread_pool.h"
#include "server/api/edge/access/access_control.h"
#include "server/decomposition/worker/remote_runs.h"

namespace carillon {

/// carillon.worker.v1.JobRunService. The objects that the constructor gets by reference must
/// outlive the service.
class JobRunService final : public RawService<worker::v1::JobRunService> {
 public:
  /// Wrong tokens are logged through `access`.
  JobRunService(RemoteRuns& runs, AccessControl& access, ThreadPool& pool)
      : runs_(runs), access_(access), pool_(pool) {
    ReadRaw("UploadResult", &JobRunService::UploadResultRaw);
  }

  grpc::ServerWriteReactor<worker::v1::FetchMeshResponse>* FetchMesh(
      grpc::CallbackServerContext* context, const worker::v1::FetchMeshRequest* request) override;
  grpc::ServerUnaryReactor* ReportProgress(grpc::CallbackServerContext* context,
                                           const worker::v1::ReportProgressRequest* request,
                                           worker::v1::ReportProgressResponse* response) override;

 private:
  grpc::ServerReadReactor<grpc::ByteBuffer>* UploadResultRaw(
      grpc::CallbackServerContext* context, worker::v1::UploadResultResponse* response);

  RemoteRuns& runs_;
  AccessControl& access_;
  ThreadPool& pool_;
};

}  // namespace carillon
