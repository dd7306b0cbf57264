// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/model_sql.h"

#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/algorithm/container.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"
#include "server/mode_database/codec/model_checker.h"
#include "server/mode_database/utf8_prefix.h"

namespace carillon {
namespace {

constexpr char kSelectModels[] =
    "SELECT revision, digest, label, stored_bytes, created_unix_ms, pinned, sounded_unix_ms, "
    "quarantined, header_xxh3, header FROM models ";

absl::StatusOr<ModelSummary> ParseModel(const SqlRow& row) {
  ModelSummary model{.digest = row.Text(1),
                     // Older versions cut labels within letters.
                     .label = Utf8Prefix(row.Text(2), row.Text(2).size()),
                     .stored_bytes = static_cast<uint64_t>(row.Int(3)),
                     .created_unix_ms = row.Int(4),
                     .revision = row.Int(0),
                     .pinned = row.Int(5) != 0,
                     .sounded_unix_ms = row.Int(6)};
  if (row.Int(7) != 0) return ModelCorrupt(model.digest, "it is in quarantine");
  const std::string_view header = row.Blob(9);
  if (std::bit_cast<int64_t>(Xxh3(header)) != row.Int(8) ||
      !model.header.ParseFromArray(header.data(), static_cast<int>(header.size()))) {
    return ModelCorrupt(model.digest, "the hash of its header is wrong");
  }
  return model;
}

absl::Status SelectTags(SqliteConnection& connection, ModelSummary& model) {
  return connection.Query("SELECT tag FROM model_tags WHERE digest = ? ORDER BY tag LIMIT ?",
                          {model.digest, static_cast<int64_t>(kMaxTagCount)},
                          [&](const SqlRow& row) {
                            model.tags.push_back(row.Text(0));
                            return absl::OkStatus();
                          });
}

absl::Status SelectTagsAndMaterial(SqliteConnection& connection, ModelSummary& model) {
  RETURN_IF_ERROR(SelectTags(connection, model));
  ASSIGN_OR_RETURN(model.material, SelectMaterial(connection, model.digest));
  return absl::OkStatus();
}

absl::Status CheckTagCount(SqliteConnection& connection, const std::string& digest) {
  return connection.Query(
      "SELECT count(*) FROM model_tags WHERE digest = ?", {digest}, [&](const SqlRow& row) {
        const auto count = static_cast<uint64_t>(row.Int(0));
        return count > kMaxTagCount ? TooManyTags(digest, count) : absl::OkStatus();
      });
}

absl::Status InsertHeader(SqliteConnection& connection, const ModelSummary& summary) {
  const std::string header = summary.header.SerializeAsString();
  return connection.Run(
      "INSERT INTO models (digest, label, stored_bytes, created_unix_ms, pinned, sounded_unix_ms, "
      "header_xxh3, header) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      {summary.digest, summary.label, static_cast<int64_t>(summary.stored_bytes),
       summary.created_unix_ms, static_cast<int64_t>(summary.pinned), summary.sounded_unix_ms,
       std::bit_cast<int64_t>(Xxh3(header)), SqlBlob{header}});
}

absl::Status InsertChunk(SqliteConnection& connection, int64_t revision, int64_t number,
                         const v1::ModalModelChunk& chunk) {
  return connection.Run(
      "INSERT INTO model_chunks (revision, number, array, byte_offset, xxh3, data) "
      "VALUES (?, ?, ?, ?, ?, ?)",
      {revision, number, static_cast<int64_t>(chunk.array()), static_cast<int64_t>(chunk.offset()),
       std::bit_cast<int64_t>(chunk.xxh3()), SqlBlob{chunk.data()}});
}

absl::Status RemoveOldRevision(SqliteConnection& connection, ModelSummary& summary) {
  RETURN_IF_ERROR(
      connection.Query("SELECT label, pinned, sounded_unix_ms FROM models WHERE digest = ?",
                       {summary.digest}, [&](const SqlRow& row) {
                         if (!row.Text(0).empty()) summary.label = row.Text(0);
                         summary.pinned = row.Int(1) != 0;
                         summary.sounded_unix_ms = row.Int(2);
                         return absl::OkStatus();
                       }));
  return connection.Run("DELETE FROM models WHERE digest = ?", {summary.digest});
}

}  // namespace

absl::Status ModelNotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "MODAL_MODEL_NOT_FOUND",
                 absl::StrCat("no modal model is named modalModels/", digest,
                              ": create or import it first, and let its job succeed"));
}

absl::Status TooManyTags(const std::string& digest, uint64_t count) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "TOO_MANY_TAGS",
      absl::StrCat("modalModels/", digest, " would have ", count, " tags; a model has at most ",
                   kMaxTagCount, ": remove some of them first"));
}

absl::Status ModelCorrupt(const std::string& digest, absl::string_view what) {
  return Refusal(absl::StatusCode::kDataLoss, "MODAL_MODEL_CORRUPT",
                 absl::StrCat("modalModels/", digest, " has changed on the disk (", what,
                              "): wait for its job, which computes it again; where it has none, "
                              "import it from a copy"));
}

absl::StatusOr<std::optional<v1::Material>> SelectMaterial(SqliteConnection& connection,
                                                           const std::string& digest) {
  std::optional<v1::Material> material;
  RETURN_IF_ERROR(
      connection.Query("SELECT xxh3, material FROM model_materials WHERE digest = ?", {digest},
                       [&](const SqlRow& row) {
                         // A damaged row is as good as none: the next request for the model writes
                         // it again.
                         const std::string_view bytes = row.Blob(1);
                         v1::Material read;
                         if (std::bit_cast<int64_t>(Xxh3(bytes)) == row.Int(0) &&
                             read.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
                           read.DiscardUnknownFields();
                           material = std::move(read);
                         }
                         return absl::OkStatus();
                       }));
  return material;
}

absl::Status StoreMaterial(SqliteConnection& connection, const std::string& digest,
                           const v1::Material& material) {
  const std::string bytes = material.SerializeAsString();
  return connection.Run(
      "INSERT INTO model_materials (digest, xxh3, material) VALUES (?, ?, ?) ON CONFLICT (digest) "
      "DO UPDATE SET xxh3 = excluded.xxh3, material = excluded.material",
      {digest, std::bit_cast<int64_t>(Xxh3(bytes)), SqlBlob{bytes}});
}

absl::StatusOr<ModelSummary> SelectModel(SqliteConnection& connection, const std::string& digest) {
  absl::StatusOr<ModelSummary> model = ModelNotFound(digest);
  absl::Status status = connection.Query(absl::StrCat(kSelectModels, "WHERE digest = ?").c_str(),
                                         {digest}, [&](const SqlRow& row) {
                                           model = ParseModel(row);
                                           return model.status();
                                         });
  if (status.ok() && model.ok()) status = SelectTagsAndMaterial(connection, *model);
  if (!status.ok()) return status;
  return model;
}

absl::StatusOr<bool> SelectModels(SqliteConnection& connection, const ModelFilter& filter,
                                  int64_t below, int64_t limit,
                                  absl::FunctionRef<void(ModelSummary)> on_model,
                                  absl::FunctionRef<void(std::string, absl::Status)> on_damaged) {
  std::vector<ModelSummary> models;
  size_t header_bytes = 0;
  bool is_full = false;
  absl::Status status = connection.Query(
      absl::StrCat(kSelectModels,
                   "WHERE revision < ?1 AND quarantined = 0 "
                   "AND (?2 = '' OR instr(lower(label), lower(?2)) > 0) "
                   "AND (?3 = '' OR digest IN (SELECT digest FROM model_tags WHERE tag = ?3)) "
                   "AND stored_bytes BETWEEN ?4 AND ?5 "
                   "AND created_unix_ms >= ?6 AND created_unix_ms < ?7 "
                   "ORDER BY revision DESC LIMIT ?8")
          .c_str(),
      {below, filter.label_contains, filter.tag, filter.min_stored_bytes, filter.max_stored_bytes,
       filter.created_since_unix_ms, filter.created_before_unix_ms, limit},
      [&](const SqlRow& row) {
        absl::StatusOr<ModelSummary> model = ParseModel(row);
        if (model.ok()) {
          models.push_back(*std::move(model));
        } else {
          on_damaged(row.Text(1), model.status());
        }
        header_bytes += row.Blob(9).size();
        is_full = header_bytes >= kMaxHeaderBytes;
        return is_full ? absl::CancelledError("the page is full") : absl::OkStatus();
      });
  if (is_full && absl::IsCancelled(status)) status = absl::OkStatus();
  for (ModelSummary& model : models) {
    if (status.ok()) status = SelectTagsAndMaterial(connection, model);
    if (status.ok()) on_model(std::move(model));
  }
  if (!status.ok()) return status;
  return is_full;
}

absl::Status SelectChunks(SqliteConnection& connection, int64_t revision, int64_t first,
                          int64_t limit,
                          absl::FunctionRef<absl::Status(const ChunkView&)> on_chunk) {
  return connection.Query(
      "SELECT array, byte_offset, xxh3, data FROM model_chunks "
      "WHERE revision = ? AND number >= ? ORDER BY number LIMIT ?",
      {revision, first, limit}, [&](const SqlRow& row) {
        return on_chunk({static_cast<uint32_t>(row.Int(0)), static_cast<uint64_t>(row.Int(1)),
                         std::bit_cast<uint64_t>(row.Int(2)), row.Blob(3)});
      });
}

absl::StatusOr<ModalModel> ReadModel(SqliteConnection& connection, const ModelSummary& summary) {
  ModelDecoder decoder;
  v1::ModalModelRecord header;
  *header.mutable_header() = summary.header;
  absl::Status bad = decoder.Append(header);
  const absl::Status status =
      SelectChunks(connection, summary.revision, 0, std::numeric_limits<int64_t>::max(),
                   [&](const ChunkView& chunk) {
                     if (bad.ok()) bad = decoder.AppendChunk(chunk);
                     return bad;
                   });
  // An error in reading does not prove that the model is damaged.
  if (bad.ok() && !status.ok() && !absl::IsDataLoss(status)) return status;
  if (!status.ok()) return ModelCorrupt(summary.digest, status.message());
  absl::StatusOr<ModalModel> model = decoder.Finish(summary.digest);
  if (!model.ok()) return ModelCorrupt(summary.digest, model.status().message());
  return model;
}

absl::StatusOr<std::vector<double>> ReadEigenvalues(SqliteConnection& connection,
                                                    const ModelSummary& summary) {
  const auto& arrays = summary.header.arrays();
  const auto wanted = static_cast<uint32_t>(
      absl::c_find_if(arrays, [](const auto& array) { return array.name() == "eigenvalues"; }) -
      arrays.begin());
  std::string bytes;
  bool is_past = false;
  absl::Status bad;
  const auto take = [&](const ChunkView& chunk) -> absl::Status {
    is_past = chunk.array > wanted;
    if (is_past) return absl::CancelledError("the arrays that follow are not read");
    if (chunk.array < wanted) return absl::OkStatus();
    if (Xxh3(chunk.data) != chunk.xxh3) bad = ModelCorrupt(summary.digest, "a hash is wrong");
    bytes += chunk.data;
    return bad;
  };
  const absl::Status status =
      SelectChunks(connection, summary.revision, 0, std::numeric_limits<int64_t>::max(), take);
  RETURN_IF_ERROR(bad);
  if (absl::IsDataLoss(status)) return ModelCorrupt(summary.digest, status.message());
  if (!is_past) RETURN_IF_ERROR(status);
  std::vector<double> eigenvalues(summary.header.mode_count());
  if (bytes.size() != eigenvalues.size() * sizeof(double)) {
    return ModelCorrupt(summary.digest, "eigenvalues are missing");
  }
  std::memcpy(eigenvalues.data(), bytes.data(), bytes.size());
  return eigenvalues;
}

absl::Status InsertModel(SqliteConnection& connection, ModelFileReader& records,
                         ModelSummary& summary) {
  absl::Status status = RemoveOldRevision(connection, summary);
  ModelChecker checker;
  for (int64_t number = -1; status.ok(); ++number) {
    ASSIGN_OR_RETURN(const auto record, records.Next());
    if (!record.has_value()) {
      status = checker.Finish();
      return status.ok() ? SelectTags(connection, summary) : status;
    }
    status = checker.Check(*record);
    if (!status.ok()) return status;
    if (number >= 0) {
      status = InsertChunk(connection, summary.revision, number, record->chunk());
      continue;
    }
    summary.header = checker.header();
    summary.stored_bytes = checker.array_bytes();
    status = InsertHeader(connection, summary);
    summary.revision = connection.last_row_id();
  }
  return status;
}

absl::Status InsertCopy(SqliteConnection& connection, const std::string& digest,
                        ModelSummary& summary) {
  const int64_t from = summary.revision;
  summary.digest = digest;
  summary.pinned = false;
  summary.sounded_unix_ms = 0;
  summary.tags.clear();
  RETURN_IF_ERROR(InsertHeader(connection, summary));
  summary.revision = connection.last_row_id();
  return connection.Run(
      "INSERT INTO model_chunks (revision, number, array, byte_offset, xxh3, data) "
      "SELECT ?, number, array, byte_offset, xxh3, data FROM model_chunks WHERE revision = ?",
      {summary.revision, from});
}

absl::Status UpdateModel(SqliteConnection& connection, const std::string& digest,
                         const ModelChange& change) {
  if (change.label.has_value()) {
    RETURN_IF_ERROR(connection.Run("UPDATE models SET label = ? WHERE digest = ?",
                                   {Utf8Prefix(*change.label, kMaxLabelBytes), digest}));
  }
  if (change.pinned.has_value()) {
    RETURN_IF_ERROR(connection.Run("UPDATE models SET pinned = ? WHERE digest = ?",
                                   {static_cast<int64_t>(*change.pinned), digest}));
  }
  if (change.material.has_value()) {
    RETURN_IF_ERROR(StoreMaterial(connection, digest, *change.material));
  }
  for (const std::string& tag : change.add_tags) {
    RETURN_IF_ERROR(connection.Run("INSERT OR IGNORE INTO model_tags (tag, digest) VALUES (?, ?)",
                                   {tag, digest}));
  }
  for (const std::string& tag : change.remove_tags) {
    RETURN_IF_ERROR(
        connection.Run("DELETE FROM model_tags WHERE tag = ? AND digest = ?", {tag, digest}));
  }
  return change.add_tags.empty() ? absl::OkStatus() : CheckTagCount(connection, digest);
}

absl::Status StoreSounded(SqliteConnection& connection, const std::string& digest,
                          int64_t unix_ms) {
  return connection.Run("UPDATE models SET sounded_unix_ms = ? WHERE digest = ?",
                        {unix_ms, digest});
}

absl::StatusOr<bool> QuarantineModel(SqliteConnection& connection, const std::string& digest) {
  RETURN_IF_ERROR(connection.Run(
      "UPDATE models SET quarantined = 1 WHERE digest = ? AND quarantined = 0", {digest}));
  return connection.changed_row_count() > 0;
}

absl::StatusOr<int64_t> CountChunks(SqliteConnection& connection, const ModelSummary& summary) {
  int64_t count = 0;
  uint64_t stored_bytes = 0;
  RETURN_IF_ERROR(connection.Query(
      "SELECT count(*), coalesce(sum(length(data)), 0) FROM model_chunks WHERE revision = ?",
      {summary.revision}, [&](const SqlRow& row) {
        count = row.Int(0);
        stored_bytes = static_cast<uint64_t>(row.Int(1));
        return absl::OkStatus();
      }));
  if (stored_bytes != summary.stored_bytes)
    return ModelCorrupt(summary.digest, "chunks are missing");
  return count;
}

absl::Status SelectSizes(SqliteConnection& connection,
                         absl::FunctionRef<void(const ModelSize&)> on_model) {
  return connection.Query(
      "SELECT digest, stored_bytes + (SELECT coalesce(sum(transfers.stored_bytes), 0) "
      "FROM transfers WHERE transfers.revision = models.revision), pinned FROM models "
      "ORDER BY max(sounded_unix_ms, created_unix_ms), revision",
      {}, [&](const SqlRow& row) {
        on_model({row.Text(0), static_cast<uint64_t>(row.Int(1)), row.Int(2) != 0});
        return absl::OkStatus();
      });
}

absl::Status DeleteModelRows(SqliteConnection& connection, const std::string& digest) {
  RETURN_IF_ERROR(connection.Run("DELETE FROM models WHERE digest = ?", {digest}));
  if (connection.changed_row_count() == 0) return ModelNotFound(digest);
  RETURN_IF_ERROR(connection.Run("DELETE FROM model_tags WHERE digest = ?", {digest}));
  RETURN_IF_ERROR(connection.Run("DELETE FROM model_materials WHERE digest = ?", {digest}));
  return connection.Run("DELETE FROM jobs WHERE digest = ?1 OR transfer_of = ?1", {digest});
}

}  // namespace carillon
