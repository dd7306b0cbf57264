// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/mode_database.h"

#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"

namespace carillon {

absl::StatusOr<std::unique_ptr<ModeDatabase>> ModeDatabase::Open(const std::filesystem::path& file,
                                                                 const Clock& clock) {
  ASSIGN_OR_RETURN(std::unique_ptr<Database> database, Database::Open(file));
  database->CopyLog();
  RemoveUnfinishedCopies(database->file());
  return std::unique_ptr<ModeDatabase>(new ModeDatabase(std::move(database), clock));
}

ModeDatabase::ModeDatabase(std::unique_ptr<Database> database, const Clock& clock)
    : database_(std::move(database)),
      meshes_(*database_, clock),
      models_(*database_, clock),
      transfers_(*database_, clock),
      jobs_(*database_) {}

std::filesystem::path ModeDatabase::folder() const { return database_->folder(); }

ModeDatabase::~ModeDatabase() = default;

}  // namespace carillon
