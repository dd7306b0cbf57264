// SPDX-License-Identifier: Apache-2.0
#include "server/api/job_run_service.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/bearer_token.h"
#include "server/api/file_pieces.h"
#include "server/api/read_call.h"
#include "server/api/resource_name.h"
#include "server/api/stream_call.h"
#include "server/api/unary_call.h"

namespace carillon {
namespace {

absl::Status Incomplete(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "RESULT_INCOMPLETE",
                 absl::StrCat(what, ": send the result again, the end last"));
}

/// Takes the records of a result, then the end of the run.
class ResultSink {
 public:
  ResultSink(RemoteRuns& runs, std::string token) : runs_(&runs), token_(std::move(token)) {}

  absl::Status Append(const v1::UploadResultRequest& request) {
    RETURN_IF_ERROR(Begin(request.job()));
    if (end_) return Drop(Incomplete("something follows the end of the run"));
    if (request.has_record()) return Drop(upload_->Append(request.record()));
    if (request.has_transfer()) return Drop(upload_->Append(request.transfer()));
    if (request.has_end()) end_ = request.end();
    return absl::OkStatus();
  }

  absl::Status Finish(v1::UploadResultResponse&) {
    if (!upload_ || !end_) return Drop(Incomplete("the end of the run has not come"));
    return Drop(upload_->Finish(*end_));
  }

 private:
  absl::Status Begin(const std::string& job) {
    if (upload_) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(job));
    ASSIGN_OR_RETURN(upload_, runs_->BeginUpload(digest, token_));
    return absl::OkStatus();
  }

  /// Deletes what was uploaded before the caller hears of a refusal.
  absl::Status Drop(absl::Status status) {
    if (!status.ok()) upload_.reset();
    return status;
  }

  RemoteRuns* runs_;
  std::string token_;
  std::optional<RunUpload> upload_;
  std::optional<v1::RunEnd> end_;
};

/// Sends a mesh file piece by piece.
class MeshCall final : public ServerStream<v1::FetchMeshResponse> {
 public:
  MeshCall(RemoteRuns& runs, std::string job, std::string token, ThreadPool& pool)
      : StreamWriter(&pool), runs_(runs), job_(std::move(job)), token_(std::move(token)) {
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> Fill(v1::FetchMeshResponse& response) override {
    if (!std::exchange(begun_, true)) RETURN_IF_ERROR(Begin());
    return mesh_.Next(*response.mutable_data());
  }

  absl::Status Begin() {
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(job_));
    ASSIGN_OR_RETURN(const auto path, runs_.Begin(digest, token_));
    mesh_.Open(path);
    return absl::OkStatus();
  }

  RemoteRuns& runs_;
  const std::string job_, token_;
  bool begun_ = false;
  FilePieces mesh_;
};

}  // namespace

grpc::ServerWriteReactor<v1::FetchMeshResponse>* JobRunService::FetchMesh(
    grpc::CallbackServerContext* context, const v1::FetchMeshRequest* request) {
  return new MeshCall(runs_, request->job(), BearerToken(*context), pool_);
}

grpc::ServerUnaryReactor* JobRunService::ReportProgress(grpc::CallbackServerContext* context,
                                                        const v1::ReportProgressRequest* request,
                                                        v1::ReportProgressResponse*) {
  return Answer(context, pool_, [this, context, request] {
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(request->job()));
    return runs_.Report(digest, BearerToken(*context), request->progress());
  });
}

grpc::ServerReadReactor<v1::UploadResultRequest>* JobRunService::UploadResult(
    grpc::CallbackServerContext* context, v1::UploadResultResponse* response) {
  return new ReadCall<v1::UploadResultRequest, v1::UploadResultResponse, ResultSink>(
      *context, *response, ResultSink(runs_, BearerToken(*context)), pool_);
}

}  // namespace carillon
