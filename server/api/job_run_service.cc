// SPDX-License-Identifier: Apache-2.0
#include "server/api/job_run_service.h"

#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/bearer_token.h"
#include "server/api/read_call.h"
#include "server/api/resource_name.h"
#include "server/api/unary_call.h"

namespace carillon {
namespace {

constexpr size_t kPieceBytes = 1 << 20;

absl::Status Incomplete(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "RESULT_INCOMPLETE",
                 absl::StrCat(what, ": send the result again, the end last"));
}

/// Takes the records of a result, then its end.
class ResultSink {
 public:
  ResultSink(RemoteRuns& runs, std::string token) : runs_(&runs), token_(std::move(token)) {}

  absl::Status Append(const v1::UploadResultRequest& request) {
    if (absl::Status status = Begin(request.job()); !status.ok()) return status;
    if (end_) return Drop(Incomplete("something follows the end of the run"));
    if (request.has_record()) return Drop(upload_->Append(request.record()));
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
    const absl::StatusOr<std::string> digest = ParseJobName(job);
    if (!digest.ok()) return digest.status();
    absl::StatusOr<RunUpload> upload = runs_->BeginUpload(*digest, token_);
    if (!upload.ok()) return upload.status();
    upload_ = *std::move(upload);
    return absl::OkStatus();
  }

  /// Before the caller is told of a refusal, nothing of its result is there any more.
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
class MeshReactor final : public grpc::ServerWriteReactor<v1::FetchMeshResponse> {
 public:
  MeshReactor(RemoteRuns& runs, std::string job, std::string token, WorkPool& pool) : pool_(pool) {
    pool_.Run(
        [this, &runs, job = std::move(job), token = std::move(token)] { Begin(runs, job, token); });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    pool_.Run([this] { SendNext(); });
  }

  void OnDone() override { delete this; }

 private:
  void Begin(RemoteRuns& runs, const std::string& job, const std::string& token) {
    const absl::StatusOr<std::string> digest = ParseJobName(job);
    if (!digest.ok()) return Finish(ToGrpcStatus(digest.status()));
    const auto mesh = runs.Begin(*digest, token);
    if (!mesh.ok()) return Finish(ToGrpcStatus(mesh.status()));
    file_.open(*mesh, std::ios::binary);
    SendNext();
  }

  void SendNext() {
    std::string& data = *response_.mutable_data();
    data.resize(kPieceBytes);
    file_.read(data.data(), static_cast<std::streamsize>(data.size()));
    data.resize(static_cast<size_t>(file_.gcount()));
    if (data.empty()) return Finish(grpc::Status::OK);
    StartWrite(&response_);
  }

  WorkPool& pool_;
  std::ifstream file_;
  v1::FetchMeshResponse response_;
};

}  // namespace

grpc::ServerWriteReactor<v1::FetchMeshResponse>* JobRunService::FetchMesh(
    grpc::CallbackServerContext* context, const v1::FetchMeshRequest* request) {
  return new MeshReactor(runs_, request->job(), BearerToken(*context), pool_);
}

grpc::ServerUnaryReactor* JobRunService::ReportProgress(grpc::CallbackServerContext* context,
                                                        const v1::ReportProgressRequest* request,
                                                        v1::ReportProgressResponse*) {
  return Answer(context, pool_, [this, context, request] {
    const absl::StatusOr<std::string> digest = ParseJobName(request->job());
    if (!digest.ok()) return digest.status();
    return runs_.Report(*digest, BearerToken(*context), request->progress());
  });
}

grpc::ServerReadReactor<v1::UploadResultRequest>* JobRunService::UploadResult(
    grpc::CallbackServerContext* context, v1::UploadResultResponse* response) {
  return new ReadReactor<v1::UploadResultRequest, v1::UploadResultResponse, ResultSink>(
      *context, *response, ResultSink(runs_, BearerToken(*context)), pool_);
}

}  // namespace carillon
