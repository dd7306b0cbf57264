// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/mesh_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <map>
#include <optional>
#include <system_error>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "carillon/v1/modal_model.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database.h"

namespace carillon {
namespace {

constexpr size_t kChunkBytes = 1 << 20;

absl::StatusOr<std::optional<StoredMesh>> Select(SqliteConnection& connection,
                                                 const std::string& digest) {
  std::optional<StoredMesh> mesh;
  RETURN_IF_ERROR(connection.Query("SELECT byte_count FROM meshes WHERE digest = ?", {digest},
                                   [&](const SqlRow& row) {
                                     mesh = StoredMesh{digest, static_cast<uint64_t>(row.Int(0))};
                                     return absl::OkStatus();
                                   }));
  return mesh;
}

absl::Status Insert(SqliteConnection& connection, const StoredMesh& mesh, int64_t unix_ms,
                    SpoolFile& file) {
  ASSIGN_OR_RETURN(const auto known, Select(connection, mesh.digest));
  if (known.has_value()) {
    return connection.Run("UPDATE meshes SET uploaded_unix_ms = ? WHERE digest = ?",
                          {unix_ms, mesh.digest});
  }
  absl::Status status =
      connection.Run("INSERT INTO meshes (digest, byte_count, uploaded_unix_ms) VALUES (?, ?, ?)",
                     {mesh.digest, static_cast<int64_t>(mesh.byte_count), unix_ms});
  if (status.ok()) status = file.Rewind();
  for (uint64_t offset = 0; status.ok() && offset < mesh.byte_count; offset += kChunkBytes) {
    ASSIGN_OR_RETURN(const std::string bytes, file.Read(kChunkBytes));
    status = connection.Run("INSERT INTO mesh_chunks (digest, byte_offset, data) VALUES (?, ?, ?)",
                            {mesh.digest, static_cast<int64_t>(offset), SqlBlob{bytes}});
  }
  return status;
}

/// Calls `on_mesh` with the mesh of each model and each job. A row that cannot be read is
/// skipped.
absl::Status ForEachReference(SqliteConnection& connection,
                              absl::FunctionRef<void(const std::string&)> on_mesh) {
  RETURN_IF_ERROR(connection.Query("SELECT header FROM models", {}, [&](const SqlRow& row) {
    v1::ModalModelHeader header;
    const std::string_view bytes = row.Blob(0);
    if (header.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      on_mesh(header.mesh_digest());
    }
    return absl::OkStatus();
  }));
  return connection.Query("SELECT request FROM jobs", {}, [&](const SqlRow& row) {
    v1::CreateModalModelRequest request;
    const std::string_view bytes = row.Blob(0);
    if (request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      on_mesh(request.mesh_digest());
    }
    return absl::OkStatus();
  });
}

absl::Status NotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "MESH_NOT_FOUND",
                 absl::StrCat("no mesh has the digest ", digest, ": upload it first"));
}

absl::Status CannotWrite(const std::filesystem::path& file) {
  const std::string why = std::generic_category().message(errno);
  return Refusal(absl::StatusCode::kResourceExhausted, "DATABASE_FULL",
                 absl::StrCat("the mesh file ", file.string(), " cannot be written (", why,
                              "): free space there"));
}

/// A new file that only its owner may read.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path)
      : path_(path),
        descriptor_(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600)) {}
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  ~NewFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }

  bool is_open() const { return descriptor_ >= 0; }

  absl::Status Append(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return CannotWrite(path_);
      bytes.remove_prefix(static_cast<size_t>(written));
    }
    return absl::OkStatus();
  }

 private:
  const std::filesystem::path& path_;
  int descriptor_;
};

}  // namespace

absl::Status MeshUpload::Append(std::string_view bytes) {
  if (bytes.size() > MeshStore::kMaxByteCount - byte_count_) {
    return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                   absl::StrCat("the mesh file has more than ", MeshStore::kMaxByteCount >> 20U,
                                " MiB: give a coarser surface, or a binary format"));
  }
  byte_count_ += bytes.size();
  digest_.Update(bytes);
  return file_.Append(bytes);
}

absl::StatusOr<StoredMesh> MeshUpload::Finish() {
  if (byte_count_ == 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                   "the mesh file has no bytes: send its content");
  }
  const StoredMesh mesh{digest_.Finish(), byte_count_};
  const auto insert = [&] {
    return meshes_->database_->Write([&](SqliteConnection& connection) {
      return Insert(connection, mesh, meshes_->clock_->UnixMs(), file_);
    });
  };
  absl::Status status = insert();
  if (absl::IsResourceExhausted(status)) {
    const auto collected = meshes_->Collect(MeshStore::kUnusedLifeOnRequest);
    if (collected.ok() && collected->mesh_count > 0) status = insert();
  }
  if (!status.ok()) return status;
  return mesh;
}

absl::StatusOr<MeshUpload> MeshStore::Begin() {
  ASSIGN_OR_RETURN(SpoolFile file, database_->MakeSpool());
  return MeshUpload(*this, std::move(file));
}

absl::StatusOr<StoredMesh> MeshStore::Put(std::string_view bytes) {
  ASSIGN_OR_RETURN(MeshUpload upload, Begin());
  RETURN_IF_ERROR(upload.Append(bytes));
  return upload.Finish();
}

absl::StatusOr<StoredMesh> MeshStore::Find(const std::string& digest) {
  std::optional<StoredMesh> mesh;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(auto found, Select(connection, digest));
    mesh = std::move(found);
    return absl::OkStatus();
  }));
  if (!mesh.has_value()) return NotFound(digest);
  return *mesh;
}

absl::Status MeshStore::WriteFile(const std::string& digest, const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(const StoredMesh mesh, Find(digest));
  NewFile out(file);
  if (!out.is_open()) return CannotWrite(file);
  Sha256 sha;
  absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return connection.Query("SELECT data FROM mesh_chunks WHERE digest = ? ORDER BY byte_offset",
                            {digest}, [&](const SqlRow& row) {
                              sha.Update(row.Blob(0));
                              return out.Append(row.Blob(0));
                            });
  });
  if (!status.ok()) return status;
  if (sha.Finish() == digest) return absl::OkStatus();
  // The damaged mesh is deleted, so that an upload stores it again.
  status = database_->Write([&](SqliteConnection& connection) {
    return connection.Run("DELETE FROM meshes WHERE digest = ?", {digest});
  });
  if (!status.ok()) return status;
  return Refusal(absl::StatusCode::kDataLoss, "DATABASE_CORRUPT",
                 absl::StrCat("the stored mesh ", digest,
                              " has changed on the disk: upload it again, and check the disk"));
}

absl::StatusOr<CollectedMeshes> MeshStore::Collect(std::chrono::milliseconds life, bool dry_run) {
  // The log of a full disk has room for the deletion of a few meshes at a time.
  const size_t most = dry_run ? std::numeric_limits<size_t>::max() : 32;
  CollectedMeshes all;
  CollectedMeshes some;
  do {
    ASSIGN_OR_RETURN(some, CollectSome(life, dry_run, most));
    all = {all.mesh_count + some.mesh_count, all.bytes + some.bytes};
  } while (some.mesh_count == most);
  return all;
}

absl::StatusOr<CollectedMeshes> MeshStore::CollectSome(std::chrono::milliseconds life, bool dry_run,
                                                       size_t most) {
  const int64_t before = clock_->UnixMs() - life.count();
  CollectedMeshes collected;
  RETURN_IF_ERROR(database_->WriteToFree([&](SqliteConnection& connection) {
    collected = {};
    std::map<std::string, uint64_t> unused;
    absl::Status done =
        connection.Query("SELECT digest, byte_count FROM meshes WHERE uploaded_unix_ms <= ?",
                         {before}, [&](const SqlRow& row) {
                           unused[row.Text(0)] = static_cast<uint64_t>(row.Int(1));
                           return absl::OkStatus();
                         });
    if (!done.ok() || unused.empty()) return done;
    done = ForEachReference(connection, [&](const std::string& mesh) { unused.erase(mesh); });
    for (const auto& [digest, bytes] : unused) {
      if (!done.ok() || collected.mesh_count == most) break;
      if (!dry_run) done = connection.Run("DELETE FROM meshes WHERE digest = ?", {digest});
      collected = {collected.mesh_count + 1, collected.bytes + bytes};
    }
    return done;
  }));
  return collected;
}

}  // namespace carillon
