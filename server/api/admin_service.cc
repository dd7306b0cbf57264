// SPDX-License-Identifier: Apache-2.0
#include "server/api/admin_service.h"

#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/api/bearer_token.h"
#include "server/api/unary_call.h"
#include "server/mode_database/database_admin.h"

namespace carillon {
namespace {

constexpr size_t kPieceBytes = 1 << 20;

v1::GetDatabaseStatsResponse ToProto(const DatabaseStats& stats) {
  v1::GetDatabaseStatsResponse proto;
  proto.set_model_count(stats.model_count);
  proto.set_model_bytes(stats.model_bytes);
  proto.set_quarantined_count(stats.quarantined_count);
  proto.set_mesh_count(stats.mesh_count);
  proto.set_mesh_bytes(stats.mesh_bytes);
  proto.set_unfinished_job_count(stats.unfinished_job_count);
  proto.set_job_count(stats.job_count);
  proto.set_file_bytes(stats.file_bytes);
  proto.set_free_bytes(stats.free_bytes);
  proto.set_schema_version(stats.schema_version);
  return proto;
}

/// Whether two secrets are the same, in a time that does not tell where they differ.
bool SameSecret(absl::string_view a, absl::string_view b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < a.size() && i < b.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return difference == 0;
}

/// Makes a copy beside the database, sends it piece by piece, and removes it.
class BackupReactor final : public grpc::ServerWriteReactor<v1::BackUpDatabaseResponse> {
 public:
  BackupReactor(ModeDatabase& database, absl::Status allowed, WorkPool& pool)
      : database_(database),
        pool_(pool),
        copy_(database.folder() / absl::StrCat("backup-", reinterpret_cast<uintptr_t>(this))) {
    pool_.Run([this, allowed = std::move(allowed)] { Begin(allowed); });
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return Finish(grpc::Status::CANCELLED);
    pool_.Run([this] { SendNext(); });
  }

  void OnDone() override { delete this; }

 private:
  void Begin(absl::Status status) {
    if (status.ok()) status = BackUp(database_.database(), copy_);
    if (!status.ok()) {
      Remove();
      return Finish(ToGrpcStatus(status));
    }
    response_.set_byte_count(std::filesystem::file_size(copy_));
    file_.open(copy_, std::ios::binary);
    Remove();  // open, it stays readable
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

  void Remove() {
    std::error_code ignored;
    std::filesystem::remove(copy_, ignored);
  }

  ModeDatabase& database_;
  WorkPool& pool_;
  const std::filesystem::path copy_;
  std::ifstream file_;
  v1::BackUpDatabaseResponse response_;
};

}  // namespace

absl::Status AdminService::Authorize(const grpc::CallbackServerContext& context) const {
  if (absl::StartsWith(context.peer(), "unix:")) return absl::OkStatus();
  if (!token_.empty() && SameSecret(BearerToken(context), token_)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kPermissionDenied, "ADMINISTRATOR_ONLY",
                 "this call is for administrators: come through the daemon's Unix socket, or show "
                 "the token of its --admin-token-file");
}

grpc::ServerUnaryReactor* AdminService::GetDatabaseStats(grpc::CallbackServerContext* context,
                                                         const v1::GetDatabaseStatsRequest*,
                                                         v1::GetDatabaseStatsResponse* response) {
  return Answer(context, pool_, [this, context, response] {
    if (absl::Status status = Authorize(*context); !status.ok()) return status;
    const absl::StatusOr<DatabaseStats> stats = ReadStats(database_.database());
    if (stats.ok()) *response = ToProto(*stats);
    return stats.status();
  });
}

grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>* AdminService::BackUpDatabase(
    grpc::CallbackServerContext* context, const v1::BackUpDatabaseRequest*) {
  return new BackupReactor(database_, Authorize(*context), pool_);
}

grpc::ServerUnaryReactor* AdminService::CollectGarbage(grpc::CallbackServerContext* context,
                                                       const v1::CollectGarbageRequest* request,
                                                       v1::CollectGarbageResponse* response) {
  return Answer(context, pool_, [this, context, request, response] {
    if (absl::Status status = Authorize(*context); !status.ok()) return status;
    const absl::StatusOr<Collected> collected = database_.models().Collect(request->budget_bytes());
    if (!collected.ok()) return collected.status();
    response->set_deleted_count(collected->model_count);
    response->set_deleted_bytes(collected->bytes);
    const absl::StatusOr<CollectedMeshes> meshes = database_.meshes().Collect();
    if (!meshes.ok()) return meshes.status();
    response->set_deleted_mesh_count(meshes->mesh_count);
    response->set_deleted_mesh_bytes(meshes->bytes);
    return absl::OkStatus();
  });
}

}  // namespace carillon
