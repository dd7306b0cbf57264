// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/material.pb.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/mode_database/modal_model.h"

namespace carillon {

class Database;
class ModelFileReader;
class SqliteConnection;

/// A label is cut to this length.
inline constexpr size_t kMaxLabelBytes = 200;

/// Greatest number of tags of a model. A model that an older version gave more tags is returned
/// with the first of them.
inline constexpr size_t kMaxTagCount = 100;

/// Greatest size of the header of an imported model. A page of a list ends when its headers have
/// this size, so that every client can receive it.
inline constexpr size_t kMaxHeaderBytes = size_t{1} << 20U;

/// A modal model without its arrays.
struct ModelSummary {
  std::string digest{};
  std::string label{};  ///< given when it was first stored, or changed since
  v1::ModalModelHeader header{};
  uint64_t stored_bytes = 0;  ///< of its arrays
  int64_t created_unix_ms = 0;
  int64_t revision = 0;  ///< greater for everything stored later
  bool pinned = false;   ///< garbage collection leaves it alone
  int64_t sounded_unix_ms = 0;
  std::vector<std::string> tags{};  ///< ascending
  /// The material of the newest request for the model. It is absent if the model was imported.
  std::optional<v1::Material> material{};
};

/// Which models to list: those that match all of it.
struct ModelFilter {
  std::string label_contains{};  ///< in any case
  std::string tag{};
  int64_t min_stored_bytes = 0;
  int64_t max_stored_bytes = std::numeric_limits<int64_t>::max();
  int64_t created_since_unix_ms = 0;
  int64_t created_before_unix_ms = std::numeric_limits<int64_t>::max();
};

/// What to change of a model; what is absent stays.
struct ModelChange {
  std::optional<std::string> label{};
  std::vector<std::string> add_tags{};
  std::vector<std::string> remove_tags{};
  std::optional<bool> pinned{};
  std::optional<v1::Material> material{};
};

/// What garbage collection has done.
struct Collected {
  uint64_t model_count = 0;
  uint64_t bytes = 0;
};

/// How garbage is collected.
struct CollectSettings {
  /// Digest of a model that was just stored: it stays until something newer needs the room.
  std::string spared{};
  bool dry_run = false;  ///< only counts what would be deleted
};

/// Room for stored models.
struct ModelBudget {
  uint64_t bytes = 0;  ///< of all their arrays; 0: no limit
  /// Takes log lines about collections. Called on any thread.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
};

struct ModelPage {
  std::vector<ModelSummary> models;
  std::string next_page_token;  ///< empty: this was the last page
};

class ModelStore;

/// A model that arrives record by record; each is checked as it comes. Only one thread at a time
/// may use an object.
class ModelImport {
 public:
  ModelImport(ModelImport&&) noexcept;
  ModelImport& operator=(ModelImport&&) noexcept;
  ~ModelImport();

  /// Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss (MODAL_MODEL_CORRUPT: a hash is
  /// wrong), ResourceExhausted (MODAL_MODEL_TOO_LARGE).
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

/// Reads a stored model record by record, byte for byte. No transaction stays open between two
/// records, so an export ends with an error if the model is replaced. Only one thread at a time may
/// use an object.
class ModelExport {
 public:
  /// The next record; nullopt after the last. Errors: DataLoss (MODAL_MODEL_CORRUPT, and the model
  /// goes into quarantine), Aborted (MODAL_MODEL_REPLACED: replaced or deleted meanwhile).
  absl::StatusOr<std::optional<v1::ModalModelRecord>> Next();

 private:
  friend class ModelStore;
  ModelExport(Database& database, ModelStore& store, ModelSummary summary)
      : database_(&database), store_(&store), summary_(std::move(summary)) {}

  Database* database_;
  ModelStore* store_;
  ModelSummary summary_;
  bool header_sent_ = false;
  int64_t next_chunk_ = 0;
  int64_t chunk_count_ = 0;
};

/// Modal models by digest. Safe from every thread.
///
/// A model found damaged goes into quarantine: its rows stay unchanged for an analysis of the
/// damage, but every call answers MODAL_MODEL_CORRUPT until the model is stored again.
class ModelStore {
 public:
  /// Called once for each model that goes into quarantine, with no lock of the store held.
  using OnQuarantine = std::function<void(const std::string& digest, const absl::Status& why)>;

  ModelStore(Database& database, const Clock& clock) : database_(&database), clock_(&clock) {}

  /// From now on a collection follows each model that is stored. Call before any other call.
  void KeepWithin(ModelBudget budget) { budget_ = std::move(budget); }

  /// Replaces the listener. The old one is not running when this returns and is never called again.
  void ListenToQuarantine(OnQuarantine on_quarantine);

  /// Stores the model of a file in the stored form, in one transaction, durable on return. Replaces
  /// an older revision of the same digest and keeps its label. The model is checked first: every
  /// hash, complete arrays of consistent shape, indices in range, finite numbers.
  /// Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> PutFile(const std::string& digest, const std::string& label,
                                       const std::filesystem::path& file);

  /// Stores a copy of the model `from` under `to`, with unchanged hashes, unless a model of that
  /// digest is stored, damaged or not; one transaction, durable on return. Errors: NotFound
  /// (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).
  absl::Status CopyIfAbsent(const std::string& from, const std::string& to,
                            const std::string& label);

  /// If `digest` is empty, the model is named by the SHA-256 of its file.
  /// Errors: InvalidArgument (INVALID_NAME: not a digest).
  absl::StatusOr<ModelImport> Import(const std::string& digest, const std::string& label);

  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::StatusOr<ModelExport> Export(const std::string& digest);

  /// Returns the whole model. All objects share one copy in memory. Errors: NotFound
  /// (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT: a hash is wrong, and the model goes
  /// into quarantine).
  absl::StatusOr<std::shared_ptr<const ModalModel>> Find(const std::string& digest);

  /// Does the same as Find. In addition, garbage collections count the model as having sounded now.
  absl::StatusOr<std::shared_ptr<const ModalModel>> FindToSound(const std::string& digest);

  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> Summary(const std::string& digest);

  /// Returns the eigenvalues for a Young's modulus of 1 Pa and a density of 1 kg/m^3, ascending.
  /// Errors: those of Find.
  absl::StatusOr<std::vector<double>> Eigenvalues(const std::string& digest);

  /// Returns the models, newest first, at most 1000 a page. A `page_size` of 0 means 100. A page
  /// also ends when its headers have kMaxHeaderBytes. Errors: InvalidArgument (INVALID_PAGE).
  absl::StatusOr<ModelPage> List(const ModelFilter& filter, int page_size,
                                 const std::string& page_token);

  /// Keeps the material for the model of this digest, which need not be stored yet. The material
  /// replaces an older one. It is durable on return.
  absl::Status RememberMaterial(const std::string& digest, const v1::Material& material);

  /// Returns the material that RememberMaterial stored, or nothing if there is none.
  absl::StatusOr<std::optional<v1::Material>> Material(const std::string& digest);

  /// Errors: NotFound (MODAL_MODEL_NOT_FOUND), InvalidArgument (INVALID_TAG), DataLoss
  /// (MODAL_MODEL_CORRUPT), ResourceExhausted (TOO_MANY_TAGS).
  absl::StatusOr<ModelSummary> Update(const std::string& digest, const ModelChange& change);

  /// Deletes a model, its tags, its material and its job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status Delete(const std::string& digest);

  /// Deletes models with their jobs, least recently sounded (or, never sounded, stored) first,
  /// until the arrays of those left fit into `budget_bytes`. Pinned ones and those in memory stay,
  /// and the spared one.
  absl::StatusOr<Collected> Collect(uint64_t budget_bytes, const CollectSettings& settings = {});

 private:
  friend class ModelExport;
  friend class ModelImport;
  struct Cached {
    int64_t revision = 0;
    std::weak_ptr<const ModalModel> model;
  };

  absl::StatusOr<std::shared_ptr<const ModalModel>> Load(const std::string& digest);
  absl::StatusOr<ModelSummary> Store(absl::FunctionRef<absl::StatusOr<ModelFileReader>()> open,
                                     ModelSummary named);
  absl::Status Quarantine(const std::string& digest, const absl::Status& why);
  bool InMemory(const std::string& digest) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(cache_mutex_);
  absl::Status WriteSounded(SqliteConnection& connection)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(cache_mutex_);

  Database* database_;
  const Clock* clock_;
  ModelBudget budget_;
  // Locked while a model is read, so that two objects of one model do not both read it.
  Mutex cache_mutex_;
  std::map<std::string, Cached> cache_ ABSL_GUARDED_BY(cache_mutex_);
  // When models sounded last. The next collection stores it, because an object that begins to sound
  // must not wait for the disk.
  std::map<std::string, int64_t> sounded_ ABSL_GUARDED_BY(cache_mutex_);
  Mutex listener_mutex_;
  OnQuarantine on_quarantine_ ABSL_GUARDED_BY(listener_mutex_);
};

}  // namespace carillon
