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
#include "server/base/event.h"
#include "server/base/mutex.h"
#include "server/mode_database/modal_model.h"
#include "server/mode_database/replacing.h"

namespace carillon {

class Database;
class ModelFileReader;
class SqliteConnection;

/// Greatest length of a label. A longer label is cut.
inline constexpr size_t kMaxLabelBytes = 200;

/// Greatest number of tags of a model. A model to which an older version of Carillon gave more tags
/// is returned with the first kMaxTagCount of them.
inline constexpr size_t kMaxTagCount = 100;

/// Greatest size of the header of an imported model. A page of a list ends when its headers have
/// this size, so that every client can receive it.
inline constexpr size_t kMaxHeaderBytes = size_t{1} << 20U;

/// Greatest number of modes of an imported model. A decomposition finds no more.
inline constexpr uint32_t kMaxImportedModeCount = 20'000;

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

/// Selects the models of a list: those that match all of the fields.
struct ModelFilter {
  std::string label_contains{};  ///< in upper or lower case
  std::string tag{};
  int64_t min_stored_bytes = 0;
  int64_t max_stored_bytes = std::numeric_limits<int64_t>::max();
  int64_t created_since_unix_ms = 0;
  int64_t created_before_unix_ms = std::numeric_limits<int64_t>::max();
};

/// A change of a model. Absent properties stay as they are.
struct ModelChange {
  std::optional<std::string> label{};
  std::vector<std::string> add_tags{};
  std::vector<std::string> remove_tags{};
  std::optional<bool> pinned{};
  std::optional<v1::Material> material{};
};

/// The models that a garbage collection deleted.
struct Collected {
  uint64_t model_count = 0;
  uint64_t bytes = 0;
};

/// Settings of a garbage collection.
struct CollectSettings {
  /// Digest of a model that was just stored. It is kept until a newer model needs the space.
  std::string spared{};
  bool dry_run = false;  ///< only counts what would be deleted
  /// Called for each model that was deleted, also if a later deletion fails.
  std::function<void(const std::string& digest, uint64_t bytes)> on_deleted = [](const std::string&,
                                                                                 uint64_t) {};
};

/// The largest size of all stored models together.
struct ModelBudget {
  uint64_t bytes = 0;  ///< of the arrays of all models; 0 means no limit
  /// Takes log lines about garbage collections. Any thread may call it.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
  /// Takes the deletions of models.
  EventSink log_event = [](const Event&) {};
};

struct ModelPage {
  std::vector<ModelSummary> models;
  std::string next_page_token;  ///< empty after the last page
};

class ModelStore;

/// A model that arrives record by record. Each record is checked when it comes. Only one thread at
/// a time may use an object.
class ModelImport {
 public:
  ModelImport(ModelImport&&) noexcept;
  ModelImport& operator=(ModelImport&&) noexcept;
  ~ModelImport();

  /// Takes the next record. Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss
  /// (MODAL_MODEL_CORRUPT: a hash is wrong), ResourceExhausted (MODAL_MODEL_TOO_LARGE).
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Stores the model durably. No record may follow. If a model with the same records is stored
  /// under the same digest, the stored model is returned, and nothing is changed. Errors:
  /// InvalidArgument (MODAL_MODEL_MALFORMED: records are missing), AlreadyExists
  /// (MODAL_MODEL_EXISTS: the stored model has other records and may not be replaced).
  absl::StatusOr<ModelSummary> Finish();

  /// Returns whether Finish has found the same model stored.
  bool kept() const;

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
  /// Returns the next record, or nullopt after the last one. Errors: DataLoss (MODAL_MODEL_CORRUPT,
  /// and the model goes into quarantine), Aborted (MODAL_MODEL_REPLACED: replaced or deleted
  /// meanwhile).
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

/// Stores modal models by digest. Safe from every thread.
///
/// A model that turns out to be damaged goes into quarantine. Its rows stay unchanged for an
/// analysis of the damage, but every call for the model returns MODAL_MODEL_CORRUPT until the model
/// is stored again.
class ModelStore {
 public:
  /// Called once for each model that goes into quarantine. The store holds no lock during the call.
  using OnQuarantine = std::function<void(const std::string& digest, const absl::Status& why)>;

  ModelStore(Database& database, const Clock& clock) : database_(&database), clock_(&clock) {}

  /// Lets a garbage collection follow each model that is stored from now on. Must be the first
  /// call.
  void KeepWithin(ModelBudget budget) { budget_ = std::move(budget); }

  /// Replaces the listener. When the call returns, the old listener is not running, and it is never
  /// called again.
  void ListenToQuarantine(OnQuarantine on_quarantine);

  /// Stores the model of a file in the stored form, in one transaction. The model is durable when
  /// the call returns. It replaces an older revision of the same digest, whose label is kept. First
  /// the model is checked: every hash, the completeness and the shapes of the arrays, the range of
  /// indices, and that numbers are finite. Errors: InvalidArgument (MODAL_MODEL_MALFORMED),
  /// DataLoss (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> PutFile(const std::string& digest, const std::string& label,
                                       const std::filesystem::path& file);

  /// Stores a copy of the model `from` under the digest `to`, with unchanged hashes, in one
  /// transaction. The copy is durable when the call returns. Does nothing if a model of the digest
  /// `to` is stored, damaged or not. Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss
  /// (MODAL_MODEL_CORRUPT).
  absl::Status CopyIfAbsent(const std::string& from, const std::string& to,
                            const std::string& label);

  /// Begins an import. If `digest` is empty, the model is named by the SHA-256 of its file.
  /// `replacing` says whether the import may replace a model of other content. Errors:
  /// InvalidArgument (INVALID_NAME: not a digest).
  absl::StatusOr<ModelImport> Import(const std::string& digest, const std::string& label,
                                     Replacing replacing = Replacing::kNever);

  /// Begins an export. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::StatusOr<ModelExport> Export(const std::string& digest);

  /// Returns the whole model. All objects share one copy in memory. Errors: NotFound
  /// (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT: a hash is wrong, and the model goes
  /// into quarantine).
  absl::StatusOr<std::shared_ptr<const ModalModel>> Find(const std::string& digest);

  /// Does the same as Find. In addition, garbage collections count the model as having sounded now.
  absl::StatusOr<std::shared_ptr<const ModalModel>> FindToSound(const std::string& digest);

  /// Returns a model without its arrays. Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss
  /// (MODAL_MODEL_CORRUPT).
  absl::StatusOr<ModelSummary> Summary(const std::string& digest);

  /// Returns the eigenvalues for a Young's modulus of 1 Pa and a density of 1 kg/m^3, ascending.
  /// Errors: those of Find.
  absl::StatusOr<std::vector<double>> Eigenvalues(const std::string& digest);

  /// Returns the models, newest first, at most 1000 a page. A `page_size` of 0 means 100. A page
  /// also ends when its headers together have kMaxHeaderBytes. Errors: InvalidArgument
  /// (INVALID_PAGE).
  absl::StatusOr<ModelPage> List(const ModelFilter& filter, int page_size,
                                 const std::string& page_token);

  /// Keeps the material for the model of this digest, which need not be stored yet. The material
  /// replaces an older one. It is durable on return.
  absl::Status RememberMaterial(const std::string& digest, const v1::Material& material);

  /// Returns the material that RememberMaterial stored, or nothing if there is none.
  absl::StatusOr<std::optional<v1::Material>> Material(const std::string& digest);

  /// Changes a model, and returns it without its arrays. Errors: NotFound (MODAL_MODEL_NOT_FOUND),
  /// InvalidArgument (INVALID_TAG), DataLoss (MODAL_MODEL_CORRUPT), ResourceExhausted
  /// (TOO_MANY_TAGS).
  absl::StatusOr<ModelSummary> Update(const std::string& digest, const ModelChange& change);

  /// Deletes a model, its tags, its material and its job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status Delete(const std::string& digest);

  /// Deletes models with their jobs until the arrays of the remaining models fit into
  /// `budget_bytes`. The model that sounded longest ago (or, if it never sounded, was stored
  /// longest ago) is deleted first. Pinned models, models in memory and the spared model are kept.
  absl::StatusOr<Collected> Collect(uint64_t budget_bytes, const CollectSettings& settings = {});

 private:
  friend class ModelExport;
  friend class ModelImport;
  struct Cached {
    int64_t revision = 0;
    std::weak_ptr<const ModalModel> model;
  };

  absl::StatusOr<std::shared_ptr<const ModalModel>> Load(const std::string& digest);
  /// Deletes at most `most` models in one transaction.
  absl::StatusOr<Collected> CollectSome(uint64_t budget_bytes, const CollectSettings& settings,
                                        size_t most);
  /// Deletes models until the others keep to the budget, and logs that. Spares `newest`.
  void CollectBeyondBudget(const std::string& newest);
  /// Sets `kept` if the same model is stored already, which is not looked for with kAlways.
  absl::StatusOr<ModelSummary> Store(absl::FunctionRef<absl::StatusOr<ModelFileReader>()> open,
                                     ModelSummary named, Replacing replacing, bool* kept);
  absl::Status Quarantine(const std::string& digest, const absl::Status& why);
  bool InMemory(const std::string& digest) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(cache_mutex_);
  /// Sets the time at which the model sounded last, if that is not stored yet.
  void AddSounded(ModelSummary& summary);
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
