// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/model_store.h"

#include <bit>
#include <iterator>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/base/sha256.h"
#include "server/base/xxh3.h"
#include "server/mode_database/database.h"
#include "server/mode_database/model_codec.h"
#include "server/mode_database/page_token.h"
#include "server/mode_database/spool_file.h"

namespace carillon {
namespace {

constexpr size_t kMaxLabelBytes = 200;

struct ModelRow {
  int64_t revision = 0;
  ModelSummary summary;
};

absl::Status NotFound(const std::string& digest) {
  return Refusal(absl::StatusCode::kNotFound, "MODAL_MODEL_NOT_FOUND",
                 absl::StrCat("no modal model is named modalModels/", digest,
                              ": create or import it first, and let its job succeed"));
}

absl::Status Corrupt(const std::string& digest, absl::string_view what) {
  return Refusal(absl::StatusCode::kDataLoss, "MODAL_MODEL_CORRUPT",
                 absl::StrCat("modalModels/", digest, " has changed on the disk (", what,
                              "): delete it and create it again, or import it from a copy"));
}

absl::Status CheckName(const std::string& digest) {
  if (IsSha256Hex(digest)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_NAME",
                 "a modal model is named modalModels/ and 64 lower-case hexadecimal digits");
}

constexpr char kSelectRows[] =
    "SELECT revision, digest, label, stored_bytes, created_unix_ms, header_xxh3, header FROM "
    "models ";

absl::StatusOr<ModelRow> ParseRow(const SqlRow& row) {
  ModelRow model{row.Int(0),
                 {.digest = row.Text(1),
                  .label = row.Text(2),
                  .stored_bytes = static_cast<uint64_t>(row.Int(3)),
                  .created_unix_ms = row.Int(4)}};
  const std::string_view header = row.Blob(6);
  if (std::bit_cast<int64_t>(Xxh3(header)) != row.Int(5) ||
      !model.summary.header.ParseFromArray(header.data(), static_cast<int>(header.size()))) {
    return Corrupt(model.summary.digest, "the hash of its header is wrong");
  }
  return model;
}

absl::StatusOr<ModelRow> SelectModel(SqliteConnection& connection, const std::string& digest) {
  absl::StatusOr<ModelRow> model = NotFound(digest);
  const absl::Status status = connection.Query(
      absl::StrCat(kSelectRows, "WHERE digest = ?").c_str(), {digest}, [&](const SqlRow& row) {
        model = ParseRow(row);
        return model.status();
      });
  if (!status.ok()) return status;
  return model;
}

// Calls `on_chunk` for the chunks numbered from `first` on, at most `limit`.
absl::Status SelectChunks(SqliteConnection& connection, int64_t revision, int64_t first,
                          int64_t limit,
                          absl::FunctionRef<absl::Status(v1::ModalModelRecord)> on_chunk) {
  return connection.Query(
      "SELECT array, byte_offset, xxh3, data FROM model_chunks "
      "WHERE revision = ? AND number >= ? ORDER BY number LIMIT ?",
      {revision, first, limit}, [&](const SqlRow& row) {
        v1::ModalModelRecord record;
        v1::ModalModelChunk& chunk = *record.mutable_chunk();
        chunk.set_array(static_cast<uint32_t>(row.Int(0)));
        chunk.set_offset(static_cast<uint64_t>(row.Int(1)));
        chunk.set_xxh3(std::bit_cast<uint64_t>(row.Int(2)));
        chunk.set_data(row.Blob(3).data(), row.Blob(3).size());
        return on_chunk(std::move(record));
      });
}

absl::Status InsertHeader(SqliteConnection& connection, const ModelSummary& summary) {
  const std::string header = summary.header.SerializeAsString();
  return connection.Run(
      "INSERT INTO models (digest, label, stored_bytes, created_unix_ms, header_xxh3, header) "
      "VALUES (?, ?, ?, ?, ?, ?)",
      {summary.digest, summary.label, static_cast<int64_t>(summary.stored_bytes),
       summary.created_unix_ms, std::bit_cast<int64_t>(Xxh3(header)), SqlBlob{header}});
}

absl::Status InsertChunk(SqliteConnection& connection, int64_t revision, int64_t number,
                         const v1::ModalModelChunk& chunk) {
  return connection.Run(
      "INSERT INTO model_chunks (revision, number, array, byte_offset, xxh3, data) "
      "VALUES (?, ?, ?, ?, ?, ?)",
      {revision, number, static_cast<int64_t>(chunk.array()), static_cast<int64_t>(chunk.offset()),
       std::bit_cast<int64_t>(chunk.xxh3()), SqlBlob{chunk.data()}});
}

// The label of the revision to be replaced stays; without one, `summary` keeps its own.
absl::Status RemoveOldRevision(SqliteConnection& connection, ModelSummary& summary) {
  absl::Status status = connection.Query("SELECT label FROM models WHERE digest = ?",
                                         {summary.digest}, [&](const SqlRow& row) {
                                           if (!row.Text(0).empty()) summary.label = row.Text(0);
                                           return absl::OkStatus();
                                         });
  if (!status.ok()) return status;
  return connection.Run("DELETE FROM models WHERE digest = ?", {summary.digest});
}

// Reads and checks every record, and inserts it.
absl::Status InsertModel(SqliteConnection& connection, ModelFileReader& records,
                         ModelSummary& summary) {
  absl::Status status = RemoveOldRevision(connection, summary);
  ModelChecker checker;
  int64_t revision = 0;
  for (int64_t number = -1; status.ok(); ++number) {
    const auto record = records.Next();
    if (!record.ok()) return record.status();
    if (!record->has_value()) return checker.Finish();
    status = checker.Check(**record);
    if (!status.ok()) return status;
    if (number >= 0) {
      status = InsertChunk(connection, revision, number, (*record)->chunk());
      continue;
    }
    summary.header = checker.header();
    summary.stored_bytes = checker.array_bytes();
    status = InsertHeader(connection, summary);
    revision = connection.last_row_id();
  }
  return status;
}

absl::StatusOr<ModalModel> ReadModel(SqliteConnection& connection, const ModelRow& row) {
  ModelDecoder decoder;
  v1::ModalModelRecord header;
  *header.mutable_header() = row.summary.header;
  absl::Status status = decoder.Append(header);
  if (status.ok()) {
    status = SelectChunks(connection, row.revision, 0, std::numeric_limits<int64_t>::max(),
                          [&](const v1::ModalModelRecord& chunk) { return decoder.Append(chunk); });
  }
  if (!status.ok()) return Corrupt(row.summary.digest, status.message());
  absl::StatusOr<ModalModel> model = decoder.Finish(row.summary.digest);
  if (!model.ok()) return Corrupt(row.summary.digest, model.status().message());
  return model;
}

absl::StatusOr<ModelSummary> PutRecords(Database& database, const Clock& clock,
                                        ModelFileReader records, ModelSummary summary) {
  summary.created_unix_ms = clock.UnixMs();
  const absl::Status status = database.Write(
      [&](SqliteConnection& connection) { return InsertModel(connection, records, summary); });
  if (!status.ok()) return status;
  return summary;
}

ModelSummary Named(const std::string& digest, const std::string& label) {
  ModelSummary summary;
  summary.digest = digest;
  summary.label = label.substr(0, kMaxLabelBytes);
  return summary;
}

}  // namespace

struct ModelImport::State {
  Database& database;
  const Clock& clock;
  SpoolFile file;
  ModelSummary summary;
  ModelChecker checker;
};

ModelImport::ModelImport(std::unique_ptr<State> state) : state_(std::move(state)) {}
ModelImport::ModelImport(ModelImport&&) noexcept = default;
ModelImport& ModelImport::operator=(ModelImport&&) noexcept = default;
ModelImport::~ModelImport() = default;

absl::Status ModelImport::Append(const v1::ModalModelRecord& record) {
  absl::Status status = state_->checker.Check(record);
  if (!status.ok()) return status;
  return state_->file.Append(Delimited(record));
}

absl::StatusOr<ModelSummary> ModelImport::Finish() {
  absl::Status status = state_->checker.Finish();
  if (status.ok()) status = state_->file.Rewind();
  if (!status.ok()) return status;
  return PutRecords(state_->database, state_->clock, ModelFileReader(state_->file.descriptor()),
                    state_->summary);
}

absl::StatusOr<std::optional<v1::ModalModelRecord>> ModelExport::Next() {
  if (!header_sent_) {
    header_sent_ = true;
    v1::ModalModelRecord record;
    *record.mutable_header() = std::move(header_);
    return record;
  }
  if (next_chunk_ == chunk_count_) return std::nullopt;
  std::optional<v1::ModalModelRecord> record;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return SelectChunks(connection, revision_, next_chunk_, 1, [&](v1::ModalModelRecord chunk) {
      record = std::move(chunk);
      return absl::OkStatus();
    });
  });
  if (!status.ok()) return status;
  if (!record.has_value()) {
    return Refusal(absl::StatusCode::kAborted, "MODAL_MODEL_REPLACED",
                   "the model was replaced or deleted while it was read: export it again");
  }
  if (Xxh3(record->chunk().data()) != record->chunk().xxh3()) {
    return Corrupt(digest_, absl::StrCat("the hash of chunk ", next_chunk_, " is wrong"));
  }
  ++next_chunk_;
  return record;
}

absl::StatusOr<ModelSummary> ModelStore::PutFile(const std::string& digest,
                                                 const std::string& label,
                                                 const std::filesystem::path& file) {
  if (const absl::Status status = CheckName(digest); !status.ok()) return status;
  absl::StatusOr<ModelFileReader> records = ModelFileReader::Open(file);
  if (!records.ok()) return records.status();
  return PutRecords(*database_, *clock_, *std::move(records), Named(digest, label));
}

absl::StatusOr<ModelImport> ModelStore::Import(const std::string& digest,
                                               const std::string& label) {
  if (const absl::Status status = CheckName(digest); !status.ok()) return status;
  absl::StatusOr<SpoolFile> file = SpoolFile::Make(database_->folder());
  if (!file.ok()) return file.status();
  return ModelImport(std::make_unique<ModelImport::State>(
      ModelImport::State{*database_, *clock_, *std::move(file), Named(digest, label), {}}));
}

absl::StatusOr<ModelExport> ModelStore::Export(const std::string& digest) {
  ModelExport result(*database_, digest);
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    absl::StatusOr<ModelRow> row = SelectModel(connection, digest);
    if (!row.ok()) return row.status();
    result.revision_ = row->revision;
    result.header_ = std::move(row->summary.header);
    return connection.Query("SELECT count(*) FROM model_chunks WHERE revision = ?", {row->revision},
                            [&](const SqlRow& count) {
                              result.chunk_count_ = count.Int(0);
                              return absl::OkStatus();
                            });
  });
  if (!status.ok()) return status;
  return result;
}

absl::StatusOr<std::shared_ptr<const ModalModel>> ModelStore::Find(const std::string& digest) {
  MutexLock lock(&cache_mutex_);
  std::shared_ptr<const ModalModel> model;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    const absl::StatusOr<ModelRow> row = SelectModel(connection, digest);
    if (!row.ok()) return row.status();
    Cached& cached = cache_[digest];
    model = cached.revision == row->revision ? cached.model.lock() : nullptr;
    if (model != nullptr) return absl::OkStatus();
    absl::StatusOr<ModalModel> read = ReadModel(connection, *row);
    if (!read.ok()) return read.status();
    model = std::make_shared<const ModalModel>(*std::move(read));
    cached = {row->revision, model};
    return absl::OkStatus();
  });
  std::erase_if(cache_, [](const auto& entry) { return entry.second.model.expired(); });
  if (!status.ok()) return status;
  return model;
}

absl::StatusOr<ModelSummary> ModelStore::Summary(const std::string& digest) {
  absl::StatusOr<ModelRow> row = NotFound(digest);
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    row = SelectModel(connection, digest);
    return row.status();
  });
  if (!status.ok()) return status;
  return std::move(row->summary);
}

absl::StatusOr<std::vector<double>> ModelStore::Eigenvalues(const std::string& digest) {
  const auto model = Find(digest);
  if (!model.ok()) return model.status();
  return (*model)->eigenvalues;
}

absl::StatusOr<ModelPage> ModelStore::List(int page_size, const std::string& page_token) {
  const absl::StatusOr<PageRange> range = ParsePage(page_size, page_token);
  if (!range.ok()) return range.status();
  ModelPage page;
  const absl::Status status = database_->Read([&](SqliteConnection& connection) {
    return connection.Query(
        absl::StrCat(kSelectRows, "WHERE revision < ? ORDER BY revision DESC LIMIT ?").c_str(),
        {range->below, range->size}, [&](const SqlRow& row) {
          absl::StatusOr<ModelRow> model = ParseRow(row);
          if (!model.ok()) return model.status();
          page.next_page_token = absl::StrCat(model->revision);
          page.models.push_back(std::move(model->summary));
          return absl::OkStatus();
        });
  });
  if (!status.ok()) return status;
  if (std::ssize(page.models) < range->size) page.next_page_token.clear();
  return page;
}

absl::Status ModelStore::Delete(const std::string& digest) {
  return database_->Write([&](SqliteConnection& connection) {
    absl::Status status = connection.Run("DELETE FROM models WHERE digest = ?", {digest});
    if (status.ok() && connection.changed_row_count() == 0) return NotFound(digest);
    if (status.ok()) status = connection.Run("DELETE FROM jobs WHERE digest = ?", {digest});
    return status;
  });
}

}  // namespace carillon
