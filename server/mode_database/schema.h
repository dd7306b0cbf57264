// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "server/mode_database/sqlite_connection.h"

// The tables, with their keys left of the bar:
//
//   job_clients     digest + client
//                     v
//   jobs          number | digest  label  state  priority  way  error  xxh3  request ...
//                            :                                                  :
//   model_tags       tag + digest                                               : mesh_digest
//   model_materials        digest | xxh3  material                              :
//                            :                                                  :
//   models      revision | digest  label  pinned  quarantined  header ...       :
//                  ^                                              :             :
//   model_chunks revision + number | array  byte_offset  xxh3  data             :
//   transfers    revision + speed | stored_bytes  header  xxh3  data  :         :
//                                                                 : mesh_digest :
//                                                     meshes      digest | byte_count ...
//                                                                   ^
//                                                     mesh_chunks digest + byte_offset | data
//   facts           name | value
//
// An arrow is a foreign key: chunks and transfers are deleted with the row that owns them. A dotted
// line joins equal values without a foreign key: one digest names a job, its model, and the model's
// tags and material. Tags and material therefore stay when a new revision replaces the model. The
// digest of a job that computes a transfer names only the job; jobs.transfer_of is the digest of
// the model.

namespace carillon {

/// Brings the schema of an open transaction up to date, version by version (PRAGMA user_version).
/// Errors: FailedPrecondition (SCHEMA_TOO_NEW: written by a newer Carillon).
absl::Status Migrate(SqliteConnection& connection);

}  // namespace carillon
