// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "absl/status/statusor.h"
#include "server/base/clock.h"
#include "server/mode_database/job_store.h"
#include "server/mode_database/mesh_store.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/transfer_store.h"

namespace carillon {

class Database;

/// Meshes, modal models, transfers and jobs in one SQLite file. Once a call has returned OK, its
/// change survives kill -9 and power failure (WAL, synchronous=FULL). Safe from every thread.
class ModeDatabase {
 public:
  /// Opens the file and creates it if it does not exist. Brings an older schema up to date in one
  /// transaction. `clock` must outlive the database. Errors: FailedPrecondition (SCHEMA_TOO_NEW:
  /// written by a newer Carillon; DATABASE_UNUSABLE: the file or its folder cannot be used),
  /// DataLoss (DATABASE_CORRUPT).
  static absl::StatusOr<std::unique_ptr<ModeDatabase>> Open(const std::filesystem::path& file,
                                                            const Clock& clock);
  ~ModeDatabase();

  MeshStore& meshes() { return meshes_; }
  ModelStore& models() { return models_; }
  TransferStore& transfers() { return transfers_; }
  JobStore& jobs() { return jobs_; }
  Database& database() {
    return *database_;
  }  ///< the database, for the functions of database_admin.h
  /// The folder of the database file, for other files of the daemon.
  std::filesystem::path folder() const;

 private:
  ModeDatabase(std::unique_ptr<Database> database, const Clock& clock);

  std::unique_ptr<Database> database_;
  MeshStore meshes_;
  ModelStore models_;
  TransferStore transfers_;
  JobStore jobs_;
};

}  // namespace carillon
