// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "server/mode_database/database.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {

/// Functions that read the undamaged part of a database.

/// Returns the digests that can be read from the start and from the end of `table`. `on_finding`
/// gets the error that separates both parts.
inline std::vector<std::string> Names(Database& database, const std::string& table,
                                      const std::function<void(const std::string&)>& on_finding) {
  std::vector<std::string> names;
  const absl::Status status = database.Read([&](SqliteConnection& connection) {
    return connection.Query(("SELECT digest FROM " + table + " ORDER BY rowid").c_str(), {},
                            [&](const SqlRow& row) {
                              names.push_back(row.Text(0));
                              return absl::OkStatus();
                            });
  });
  if (status.ok()) return names;
  on_finding(table + ": " + std::string(status.message()));
  // The rows behind the error are read backwards from the end.
  std::vector<std::string> from_the_end;
  database
      .Read([&](SqliteConnection& connection) {
        return connection.Query(("SELECT digest FROM " + table + " ORDER BY rowid DESC").c_str(),
                                {}, [&](const SqlRow& row) {
                                  from_the_end.push_back(row.Text(0));
                                  return absl::OkStatus();
                                });
      })
      .IgnoreError();
  names.insert(names.end(), from_the_end.rbegin(), from_the_end.rend());
  return names;
}

/// Calls `on_bytes` for each piece of a mesh, without a check of its digest.
inline absl::Status ReadMesh(Database& database, const std::string& digest,
                             absl::FunctionRef<absl::Status(std::string_view)> on_bytes) {
  return database.Read([&](SqliteConnection& connection) {
    return connection.Query("SELECT data FROM mesh_chunks WHERE digest = ? ORDER BY byte_offset",
                            {digest}, [&](const SqlRow& row) { return on_bytes(row.Blob(0)); });
  });
}

}  // namespace carillon
