// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/sha256.h"
#include "server/mode_database/model_checker.h"
#include "server/mode_database/model_codec.h"
#include "server/mode_database/model_store.h"
#include "server/mode_database/replacing.h"
#include "server/mode_database/spool_file.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

struct ModelImport::State {
  ModelStore& store;
  SpoolFile file;
  ModelSummary summary;
  Replacing replacing;
  bool kept = false;
  ModelChecker checker{};
  Sha256 sha{};
};

/// Returns whether the records are those of the model that is stored under the digest of `summary`,
/// byte for byte. If so, fills in `summary`. Returns false if no such model is stored, if it has
/// changed on the disk, or if it may be replaced. Errors: AlreadyExists (MODAL_MODEL_EXISTS).
absl::StatusOr<bool> IsStored(SqliteConnection& connection, ModelFileReader& records,
                              Replacing replacing, ModelSummary& summary);

}  // namespace carillon
