// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/job_run_service.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/file_pieces.h"
#include "server/api/call/read_call.h"
#include "server/api/call/stream_call.h"
#include "server/api/call/unary_call.h"
#include "server/api/convert/resource_name.h"

namespace carillon {
namespace {

absl::Status Incomplete(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "RESULT_INCOMPLETE",
                 absl::StrCat(what, ": send the result again, the end last"));
}

/// A caller that shows the token of a run. Wrong tokens are logged.
class RunCaller {
 public:
  RunCaller(AccessControl& access, const grpc::CallbackServerContext& context,
            const char* function = __builtin_FUNCTION())
      : access_(&access), context_(&context), function_(function), token_(BearerToken(context)) {}

  const std::string& token() const { return token_; }

  /// Returns `status`. Logs it if it is the refusal of a token.
  absl::Status Note(absl::Status status) const {
    if (!absl::IsPermissionDenied(status)) return status;
    return access_->Refuse(*context_, function_, std::move(status));
  }

 private:
  AccessControl* access_;
  const grpc::CallbackServerContext* context_;
  const char* function_;  ///< that serves the call
  std::string token_;
};

/// Takes the records of a result, and then the end of the run.
class ResultSink {
 public:
  ResultSink(RemoteRuns& runs, RunCaller caller) : runs_(&runs), caller_(std::move(caller)) {}

  absl::Status Append(const worker::v1::UploadResultRequest& request) {
    RETURN_IF_ERROR(Begin(request.job()));
    if (end_) return Drop(Incomplete("something follows the end of the run"));
    if (request.has_record()) return Drop(upload_->Append(request.record()));
    if (request.has_transfer()) return Drop(upload_->Append(request.transfer()));
    if (request.has_end()) end_ = request.end();
    return absl::OkStatus();
  }

  absl::Status Finish(worker::v1::UploadResultResponse&) {
    if (!upload_ || !end_) return Drop(Incomplete("the end of the run has not come"));
    return Drop(upload_->Finish(*end_));
  }

 private:
  absl::Status Begin(const std::string& job) {
    if (upload_) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(job));
    auto upload = runs_->BeginUpload(digest, caller_.token());
    if (!upload.ok()) return caller_.Note(upload.status());
    upload_ = *std::move(upload);
    return absl::OkStatus();
  }

  /// Deletes the uploaded records before the caller learns of a refusal.
  absl::Status Drop(absl::Status status) {
    if (!status.ok()) upload_.reset();
    return status;
  }

  RemoteRuns* runs_;
  RunCaller caller_;
  std::optional<RunUpload> upload_;
  std::optional<worker::v1::RunEnd> end_;
};

/// Sends a mesh file piece by piece.
class MeshCall final : public ServerStream<worker::v1::FetchMeshResponse> {
 public:
  MeshCall(RemoteRuns& runs, std::string job, RunCaller caller, ThreadPool& pool)
      : StreamWriter(&pool), runs_(runs), job_(std::move(job)), caller_(std::move(caller)) {
    StartWriting();
  }

 private:
  absl::StatusOr<Supply> Fill(worker::v1::FetchMeshResponse& response) override {
    if (!std::exchange(begun_, true)) RETURN_IF_ERROR(Begin());
    return mesh_.Next(*response.mutable_data());
  }

  absl::Status Begin() {
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(job_));
    const auto path = runs_.Begin(digest, caller_.token());
    if (!path.ok()) return caller_.Note(path.status());
    mesh_.Open(*path);
    return absl::OkStatus();
  }

  RemoteRuns& runs_;
  const std::string job_;
  const RunCaller caller_;
  bool begun_ = false;
  FilePieces mesh_;
};

}  // namespace

grpc::ServerWriteReactor<worker::v1::FetchMeshResponse>* JobRunService::FetchMesh(
    grpc::CallbackServerContext* context, const worker::v1::FetchMeshRequest* request) {
  return new MeshCall(runs_, request->job(), RunCaller(access_, *context), pool_);
}

grpc::ServerUnaryReactor* JobRunService::ReportProgress(
    grpc::CallbackServerContext* context, const worker::v1::ReportProgressRequest* request,
    worker::v1::ReportProgressResponse*) {
  return Answer(context, pool_, [this, request, caller = RunCaller(access_, *context)] {
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(request->job()));
    return caller.Note(runs_.Report(digest, caller.token(), request->progress()));
  });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* JobRunService::UploadResultRaw(
    grpc::CallbackServerContext* context, worker::v1::UploadResultResponse* response) {
  return new ReadCall<worker::v1::UploadResultRequest, worker::v1::UploadResultResponse,
                      ResultSink>(*context, *response,
                                  ResultSink(runs_, RunCaller(access_, *context)), pool_);
}

}  // namespace carillon
