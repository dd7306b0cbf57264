// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/admin_service.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/exception_barrier.h"
#include "server/api/call/send_call.h"
#include "server/api/call/unary_call.h"
#include "server/api/convert/resource_name.h"
#include "server/mode_database/database.h"
#include "server/mode_database/maintenance/database_admin.h"

namespace carillon {
namespace {

/// A file, read piece by piece for a stream.
class FilePieces {
 public:
  /// The file may be removed once it is open.
  void Open(const std::filesystem::path& path) { file_.open(path, std::ios::binary); }

  /// Fills `data` with the next piece.
  Supply Next(std::string& data) {
    constexpr size_t kPieceBytes = 1 << 20;
    data.resize(kPieceBytes);
    file_.read(data.data(), static_cast<std::streamsize>(data.size()));
    data.resize(static_cast<size_t>(file_.gcount()));
    return data.empty() ? Supply::kEnd : Supply::kMessage;
  }

 private:
  std::ifstream file_;
};

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

Event CollectedEvent(const v1::CollectGarbageResponse& collected) {
  return Event("models_collected")
      .With("count", collected.deleted_count())
      .With("bytes", collected.deleted_bytes())
      .With("mesh_count", collected.deleted_mesh_count())
      .With("mesh_bytes", collected.deleted_mesh_bytes());
}

/// Copies the database to a file in its folder when its turn comes, and sends the file piece by
/// piece.
class BackupCall final : public SendCall<v1::BackUpDatabaseResponse> {
 public:
  BackupCall(grpc::CallbackServerContext& context, const AdminContext& daemon, Principal caller,
             CallBounds bounds)
      : SendCall(context, std::move(bounds), daemon.background.pool),
        database_(daemon.database.database()),
        events_(daemon.background.events),
        caller_(std::move(caller)) {
    daemon.copying.Run(caller_.client, [this] {
      copied_ = WithoutExceptions([this] { return Copy(); });
      StartWriting();
    });
  }

  ~BackupCall() override {
    Event event("database_backed_up", sent_ ? LogLevel::kInfo : LogLevel::kWarning);
    event.With("outcome", Outcome()).With("bytes", copied_byte_count_);
    if (!copied_.ok()) event.With("message", copied_.message());
    events_.Log(std::move(event), caller_);
  }

 private:
  absl::string_view Outcome() const {
    if (sent_) return "sent";
    return copied_.ok() || absl::IsCancelled(copied_) ? "cancelled" : "failed";
  }

  absl::Status Copy() {
    const std::filesystem::path copy = NewBackupFile(database_.file());
    const absl::Cleanup remove = [&copy] {
      std::error_code ignored;
      std::filesystem::remove(copy, ignored);  // an open file stays readable
    };
    RETURN_IF_ERROR(BackUp(database_, copy, [this] { return !is_cancelled(); }));
    pieces_.Open(copy);
    std::error_code error;
    byte_count_ = copied_byte_count_ = std::filesystem::file_size(copy, error);
    if (!error) return absl::OkStatus();
    return Refusal(absl::StatusCode::kUnavailable, "DATABASE_IO_ERROR",
                   absl::StrCat("the unfinished backup ", copy.string(), " has gone (",
                                error.message(), "): ask for another"));
  }

  absl::StatusOr<Supply> FillNext(v1::BackUpDatabaseResponse& response) override {
    RETURN_IF_ERROR(copied_);
    response.set_byte_count(std::exchange(byte_count_, 0));
    absl::StatusOr<Supply> supply = pieces_.Next(*response.mutable_data());
    if (!supply.ok()) copied_ = supply.status();
    sent_ = supply.ok() && *supply == Supply::kEnd;
    return supply;
  }

  Database& database_;
  CallEvents& events_;
  const Principal caller_;
  absl::Status copied_;  // or the error of reading the copy
  bool sent_ = false;
  uint64_t byte_count_ = 0;  // until it has been sent
  uint64_t copied_byte_count_ = 0;
  FilePieces pieces_;
};

}  // namespace

grpc::ServerUnaryReactor* AdminService::GetDatabaseStats(grpc::CallbackServerContext* context,
                                                         const v1::GetDatabaseStatsRequest*,
                                                         v1::GetDatabaseStatsResponse* response) {
  return Answer(context, daemon_.reception, Role::kAdminister, [this, response] {
    ASSIGN_OR_RETURN(const DatabaseStats stats, ReadStats(daemon_.database.database()));
    *response = ToProto(stats);
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>* AdminService::BackUpDatabase(
    grpc::CallbackServerContext* context, const v1::BackUpDatabaseRequest*) {
  using Reactor = grpc::ServerWriteReactor<v1::BackUpDatabaseResponse>;
  return Open(
      *context, daemon_.background, {Role::kAdminister, Holding::kBackup},
      [&](const Principal& caller, ClientPlace place) -> Reactor* {
        return new BackupCall(
            *context, daemon_, caller,
            {.place = std::move(place), .idle_calls = daemon_.idle_calls, .clock = daemon_.clock});
      });
}

grpc::ServerUnaryReactor* AdminService::CollectGarbage(grpc::CallbackServerContext* context,
                                                       const v1::CollectGarbageRequest* request,
                                                       v1::CollectGarbageResponse* response) {
  return Answer(context, daemon_.writing, Role::kAdminister,
                [this, request, response](const Principal& caller) {
                  return Collect(*request, caller, *response);
                });
}

absl::Status AdminService::Collect(const v1::CollectGarbageRequest& request,
                                   const Principal& caller, v1::CollectGarbageResponse& response) {
  const bool all = request.delete_unpinned();
  const bool only_meshes = request.delete_unused_meshes();
  if ((request.budget_bytes() > 0 ? 1 : 0) + (all ? 1 : 0) + (only_meshes ? 1 : 0) != 1) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "set budget_bytes above zero, or delete_unpinned to delete every model that is "
                   "neither pinned nor sounding, or delete_unused_meshes");
  }
  const CallEvents& events = daemon_.writing.events;
  const auto log_deleted = [&](const std::string& digest, uint64_t bytes) {
    events.Log(Event("model_deleted")
                   .With("model", ModelName(digest))
                   .With("bytes", bytes)
                   .With("cause", "collection"),
               caller);
  };
  Collected models;
  if (!only_meshes) {
    ASSIGN_OR_RETURN(models, daemon_.database.models().Collect(
                                 request.budget_bytes(),
                                 {.dry_run = request.dry_run(), .on_deleted = log_deleted}));
  }
  response.set_deleted_count(models.model_count);
  response.set_deleted_bytes(models.bytes);
  const std::chrono::milliseconds life =
      all || only_meshes ? MeshStore::kUnusedLifeOnRequest : MeshStore::kUnusedLife;
  ASSIGN_OR_RETURN(const CollectedMeshes meshes,
                   daemon_.database.meshes().Collect(life, request.dry_run()));
  response.set_deleted_mesh_count(meshes.mesh_count);
  response.set_deleted_mesh_bytes(meshes.bytes);
  if (!request.dry_run()) events.Log(CollectedEvent(response), caller);
  return absl::OkStatus();
}

}  // namespace carillon
