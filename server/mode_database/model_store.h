// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/mode_database/modal_model.h"

namespace carillon {

class Database;

/// A modal model without its arrays.
struct ModelSummary {
  std::string digest{};
  std::string label{};  ///< given when it was first stored
  v1::ModalModelHeader header{};
  uint64_t stored_bytes = 0;  ///< of its arrays
  int64_t created_unix_ms = 0;
};

struct ModelPage {
  std::vector<ModelSummary> models;
  std::string next_page_token;  ///< empty: this was the last page
};

class ModelStore;

/// A model that arrives record by record; each is checked as it comes. One thread at a time.
class ModelImport {
 public:
  ModelImport(ModelImport&&) noexcept;
  ModelImport& operator=(ModelImport&&) noexcept;
  ~ModelImport();

  /// Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss (MODAL_MODEL_CORRUPT: a hash is
  /// wrong).
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Stores the model, durably; replaces one of the same digest. Call once, last.
  /// Errors: InvalidArgument (MODAL_MODEL_MALFORMED: records are missing).
  absl::StatusOr<ModelSummary> Finish();

 private:
  friend class ModelStore;
  struct State;
  explicit ModelImport(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

/// Sends a model record by record, exactly as it was stored. Holds no transaction in between: a
/// model that is replaced meanwhile ends the export. One thread at a time.
class ModelExport {
 public:
  /// The next record; nullopt after the last. Errors: DataLoss (MODAL_MODEL_CORRUPT), Aborted
  /// (MODAL_MODEL_REPLACED: replaced or deleted meanwhile).
  absl::StatusOr<std::optional<v1::ModalModelRecord>> Next();

 private:
  friend class ModelStore;
  ModelExport(Database& database, std::string digest)
      : database_(&database), digest_(std::move(digest)) {}

  Database* database_;
  std::string digest_;
  int64_t revision_ = 0;
  v1::ModalModelHeader header_;
  bool header_sent_ = false;
  int64_t next_chunk_ = 0;
  int64_t chunk_count_ = 0;
};

/// Modal models by digest. Safe from every thread.
class ModelStore {
 public:
  ModelStore(Database& database, const Clock& clock) : database_(&database), clock_(&clock) {}

  /// Stores the model of a file in the stored form, in one transaction, durable on return; replaces
  /// an older revision of the same digest, whose label stays. Checked before: every hash, that all
  /// arrays are complete and of consistent shape, indices in range, numbers finite.
  /// Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> PutFile(const std::string& digest, const std::string& label,
                                       const std::filesystem::path& file);

  /// Errors: InvalidArgument (INVALID_NAME: not a digest).
  absl::StatusOr<ModelImport> Import(const std::string& digest, const std::string& label);

  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::StatusOr<ModelExport> Export(const std::string& digest);

  /// The whole model; in memory once however many objects hold it.
  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT: a hash is wrong).
  absl::StatusOr<std::shared_ptr<const ModalModel>> Find(const std::string& digest);

  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> Summary(const std::string& digest);

  /// Eigenvalues for unit material, ascending. Errors as for Summary.
  absl::StatusOr<std::vector<double>> Eigenvalues(const std::string& digest);

  /// Newest first. `page_size` 0: 100; at most 1000. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<ModelPage> List(int page_size, const std::string& page_token);

  /// Deletes a model and its job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status Delete(const std::string& digest);

 private:
  struct Cached {
    int64_t revision = 0;
    std::weak_ptr<const ModalModel> model;
  };

  Database* database_;
  const Clock* clock_;
  // Held while a model is read, so that two objects of one model cannot read it twice.
  Mutex cache_mutex_;
  std::map<std::string, Cached> cache_ ABSL_GUARDED_BY(cache_mutex_);
};

}  // namespace carillon
