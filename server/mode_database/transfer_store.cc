// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/transfer_store.h"

#include <bit>
#include <cmath>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"
#include "server/mode_database/database.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/sqlite_connection.h"

namespace carillon {
namespace {

/// A row of the table.
struct TransferRow {
  int64_t step = 0;
  int64_t xxh3 = 0;  // of the data
  TransferSummary summary;
};

/// The rows of a revision of a model by ascending speed ratio, without those whose header has
/// changed on the disk.
absl::StatusOr<std::vector<TransferRow>> SelectRows(SqliteConnection& connection,
                                                    int64_t revision) {
  std::vector<TransferRow> rows;
  RETURN_IF_ERROR(connection.Query(
      "SELECT speed, stored_bytes, created_unix_ms, header_xxh3, xxh3, header FROM transfers "
      "WHERE revision = ? ORDER BY speed",
      {revision}, [&](const SqlRow& row) {
        const std::string_view header = row.Blob(5);
        TransferRow parsed{.step = row.Int(0), .xxh3 = row.Int(4), .summary = {}};
        parsed.summary.stored_bytes = static_cast<uint64_t>(row.Int(1));
        parsed.summary.created_unix_ms = row.Int(2);
        if (std::bit_cast<int64_t>(Xxh3(header)) == row.Int(3) &&
            parsed.summary.header.ParseFromArray(header.data(), static_cast<int>(header.size()))) {
          rows.push_back(std::move(parsed));
        }
        return absl::OkStatus();
      }));
  return rows;
}

/// Absent: its bytes have changed on the disk.
absl::StatusOr<std::optional<StoredTransfer>> ReadRow(SqliteConnection& connection,
                                                      int64_t revision, const TransferRow& row) {
  std::string data;
  RETURN_IF_ERROR(connection.Query("SELECT data FROM transfers WHERE revision = ? AND speed = ?",
                                   {revision, row.step}, [&](const SqlRow& found) {
                                     data = found.Blob(0);
                                     return absl::OkStatus();
                                   }));
  if (std::bit_cast<int64_t>(Xxh3(data)) != row.xxh3) return std::nullopt;
  absl::StatusOr<StoredTransfer> transfer = StoredTransfer::Parse(std::move(data));
  if (!transfer.ok()) return std::nullopt;
  return *std::move(transfer);
}

/// Runs `use` with the revision of the model.
absl::Status WithModel(Database& database, const std::string& digest,
                       absl::FunctionRef<absl::Status(SqliteConnection&, int64_t)> use) {
  return database.Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(const ModelSummary model, SelectModel(connection, digest));
    return use(connection, model.revision);
  });
}

/// Errors: InvalidArgument (TRANSFER_MALFORMED).
absl::Status CheckModes(SqliteConnection& connection, const ModelSummary& model,
                        const StoredTransfer& transfer) {
  ASSIGN_OR_RETURN(const std::vector<double> stored, ReadEigenvalues(connection, model));
  if (transfer.Eigenvalues() == stored) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "TRANSFER_MALFORMED",
                 absl::StrCat("the modes of the transfer are not those of modalModels/",
                              model.digest, ": compute it for this model"));
}

absl::Status Insert(SqliteConnection& connection, int64_t revision, const StoredTransfer& transfer,
                    const TransferSummary& summary) {
  const std::string header = summary.header.SerializeAsString();
  return connection.Run(
      "INSERT OR REPLACE INTO transfers (revision, speed, stored_bytes, created_unix_ms, "
      "header_xxh3, xxh3, header, data) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      {revision, SpeedStep(summary.header.speed_ratio()),
       static_cast<int64_t>(summary.stored_bytes), summary.created_unix_ms,
       std::bit_cast<int64_t>(Xxh3(header)), std::bit_cast<int64_t>(Xxh3(transfer.bytes())),
       SqlBlob{header}, SqlBlob{transfer.bytes()}});
}

/// Returns whether the transfer is stored, byte for byte. Errors: AlreadyExists
/// (MODAL_MODEL_EXISTS: it is not, and `replacing` does not let it be stored).
absl::StatusOr<bool> IsTransferStored(SqliteConnection& connection, const ModelSummary& model,
                                      const StoredTransfer& transfer, Replacing replacing) {
  if (replacing == Replacing::kAlways) return false;
  std::optional<StoredTransfer> stored;
  ASSIGN_OR_RETURN(const std::vector<TransferRow> rows, SelectRows(connection, model.revision));
  for (const TransferRow& row : rows) {
    if (row.step != SpeedStep(transfer.header().speed_ratio())) continue;
    ASSIGN_OR_RETURN(stored, ReadRow(connection, model.revision, row));
  }
  if (stored.has_value() && stored->bytes() == transfer.bytes()) return true;
  const bool replaces = stored.has_value() && model.pinned;
  if (replacing == Replacing::kUnlessPinned && !replaces) return false;
  return Refusal(
      absl::StatusCode::kAlreadyExists, "MODAL_MODEL_EXISTS",
      absl::StrCat("modalModels/", model.digest, " is stored already without this transfer of ",
                   transfer.header().speed_ratio(),
                   " times the speed of sound in air: import the model without transfers and ask "
                   "for them with CreateTransfer, or let a caller with the role administer ",
                   replaces ? "unpin the model and import it" : "import it"));
}

}  // namespace

int64_t SpeedStep(double speed_ratio) { return std::llround(100 * std::log(speed_ratio)); }

void TransferStore::Listen(OnStored on_stored) { on_stored_.Replace(std::move(on_stored)); }

absl::StatusOr<TransferSummary> TransferStore::Put(const std::string& model_digest,
                                                   const StoredTransfer& transfer,
                                                   Replacing replacing) {
  const TransferSummary summary{.header = transfer.header(),
                                .stored_bytes = transfer.bytes().size(),
                                .created_unix_ms = clock_->UnixMs()};
  RETURN_IF_ERROR(database_->Write([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(const ModelSummary model, SelectModel(connection, model_digest));
    RETURN_IF_ERROR(CheckModes(connection, model, transfer));
    ASSIGN_OR_RETURN(const bool stored, IsTransferStored(connection, model, transfer, replacing));
    return stored ? absl::OkStatus() : Insert(connection, model.revision, transfer, summary);
  }));
  on_stored_.Call(model_digest);
  return summary;
}

absl::StatusOr<TransferSummary> TransferStore::PutFile(const std::string& model_digest,
                                                       const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(const StoredTransfer transfer, StoredTransfer::ReadFile(file));
  return Put(model_digest, transfer);
}

absl::StatusOr<std::vector<TransferSummary>> TransferStore::List(const std::string& model_digest) {
  std::vector<TransferSummary> summaries;
  const auto list = [&](SqliteConnection& connection, int64_t revision) -> absl::Status {
    ASSIGN_OR_RETURN(std::vector<TransferRow> rows, SelectRows(connection, revision));
    for (TransferRow& row : rows) summaries.push_back(std::move(row.summary));
    return absl::OkStatus();
  };
  RETURN_IF_ERROR(WithModel(*database_, model_digest, list));
  return summaries;
}

absl::StatusOr<std::vector<StoredTransfer>> TransferStore::Read(const std::string& model_digest) {
  std::vector<StoredTransfer> transfers;
  const auto read = [&](SqliteConnection& connection, int64_t revision) -> absl::Status {
    ASSIGN_OR_RETURN(const std::vector<TransferRow> rows, SelectRows(connection, revision));
    for (const TransferRow& row : rows) {
      ASSIGN_OR_RETURN(std::optional<StoredTransfer> one, ReadRow(connection, revision, row));
      if (one.has_value()) transfers.push_back(*std::move(one));
    }
    return absl::OkStatus();
  };
  RETURN_IF_ERROR(WithModel(*database_, model_digest, read));
  return transfers;
}

std::shared_ptr<const Transfer> TransferStore::Find(const ModalModel& model,
                                                    double material_m_per_s) {
  const auto distance = [&](const TransferRow& row) {
    const v1::TransferHeader& header = row.summary.header;
    return std::abs(
        std::log(material_m_per_s / (header.speed_ratio() * header.sound_speed_m_per_s())));
  };
  std::shared_ptr<const Transfer> transfer;
  const auto find = [&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(const std::vector<TransferRow> rows, SelectRows(connection, model.revision));
    const TransferRow* nearest = nullptr;
    for (const TransferRow& row : rows) {
      if (!(distance(row) <= kSpeedTolerance)) continue;
      if (nearest == nullptr || distance(row) < distance(*nearest)) nearest = &row;
    }
    if (nearest == nullptr) return absl::OkStatus();
    const Key key(model.revision, nearest->step);
    transfer = Share(key, nearest->xxh3, nullptr);
    if (transfer != nullptr) return absl::OkStatus();
    ASSIGN_OR_RETURN(const auto stored, ReadRow(connection, model.revision, *nearest));
    if (!stored.has_value() || stored->header().mode_count() != model.mode_count()) {
      return absl::OkStatus();
    }
    transfer = Share(key, nearest->xxh3, std::make_shared<const Transfer>(stored->Decode()));
    return absl::OkStatus();
  };
  // A database that cannot be read leaves the object with the paper's coupling.
  database_->Read(find).IgnoreError();
  return transfer;
}

std::shared_ptr<const Transfer> TransferStore::Share(Key key, int64_t xxh3,
                                                     std::shared_ptr<const Transfer> read) {
  const MutexLock lock(&cache_mutex_);
  std::erase_if(cache_, [](const auto& entry) { return entry.second.second.expired(); });
  const auto cached = cache_.find(key);
  if (cached != cache_.end() && cached->second.first == xxh3) {
    if (auto transfer = cached->second.second.lock()) return transfer;
  }
  if (read != nullptr) cache_[key] = {xxh3, read};
  return read;
}

}  // namespace carillon
