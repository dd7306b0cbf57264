// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/spool_file.h"

namespace carillon {

class Database;
class MeshStore;

struct StoredMesh {
  std::string digest;  ///< SHA-256 of the bytes
  uint64_t byte_count = 0;
};

/// A mesh file that arrives in pieces. The pieces are collected in a nameless file in the
/// database's folder, so that a slow sender occupies neither memory nor a transaction. One thread
/// at a time. The MeshStore must outlive its uploads.
class MeshUpload {
 public:
  /// Appends the next bytes. Errors: ResourceExhausted (MESH_TOO_LARGE: over 256 MiB in all).
  absl::Status Append(std::string_view bytes);

  /// Stores the mesh durably, unless it is stored already. If the disk is full, meshes that nobody
  /// uses make room (MeshStore::kUnusedLifeOnRequest). Must be the last call. Errors:
  /// InvalidArgument (MESH_EMPTY), ResourceExhausted (DATABASE_FULL).
  absl::StatusOr<StoredMesh> Finish();

 private:
  friend class MeshStore;
  MeshUpload(MeshStore& meshes, SpoolFile file) : meshes_(&meshes), file_(std::move(file)) {}

  MeshStore* meshes_;
  SpoolFile file_;
  Sha256 digest_;
  uint64_t byte_count_ = 0;
};

/// The mesh files that a garbage collection deleted.
struct CollectedMeshes {
  uint64_t mesh_count = 0;
  uint64_t bytes = 0;
};

/// Stores mesh files as bytes under their SHA-256. Safe from every thread.
class MeshStore {
 public:
  static constexpr uint64_t kMaxByteCount = 256ULL << 20;

  /// The time for which a mesh that no model and no job refers to is kept after its last upload. A
  /// request for its model may follow.
  static constexpr std::chrono::hours kUnusedLife{24};
  /// The shorter time for which such a mesh is kept when the disk is full or somebody asks for the
  /// space.
  static constexpr std::chrono::minutes kUnusedLifeOnRequest{1};

  MeshStore(Database& database, const Clock& clock) : database_(&database), clock_(&clock) {}

  absl::StatusOr<MeshUpload> Begin();

  /// Stores a whole mesh at once.
  absl::StatusOr<StoredMesh> Put(std::string_view bytes);

  /// Returns a stored mesh. Errors: NotFound (MESH_NOT_FOUND).
  absl::StatusOr<StoredMesh> Find(const std::string& digest);

  /// Writes the mesh to a new file that only its owner may read. Errors: NotFound (MESH_NOT_FOUND),
  /// DataLoss (DATABASE_CORRUPT: the stored bytes do not match the digest; the mesh is deleted, so
  /// that it can be stored again).
  absl::Status WriteFile(const std::string& digest, const std::filesystem::path& file);

  /// Deletes meshes that no model and no job refers to and that were not uploaded in the last
  /// `life`. A dry run only counts these meshes.
  absl::StatusOr<CollectedMeshes> Collect(std::chrono::milliseconds life = kUnusedLife,
                                          bool dry_run = false);

 private:
  friend class MeshUpload;
  /// Deletes at most `most` meshes in one transaction.
  absl::StatusOr<CollectedMeshes> CollectSome(std::chrono::milliseconds life, bool dry_run,
                                              size_t most);

  Database* database_;
  const Clock* clock_;
};

}  // namespace carillon
