// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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
#include "server/base/clock.h"
#include "server/base/event.h"
#include "server/base/mutex.h"
#include "server/base/replaceable_callback.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/model_export.h"
#include "server/mode_database/model_import.h"
#include "server/mode_database/model_row.h"
#include "server/mode_database/replacing.h"

namespace carillon {

class Database;

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
  /// called again. Must not be called by a listener.
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

  /// Begins an export. Errors: NotFound (MODAL_MODEL_NOT_FOUND), DataLoss (MODAL_MODEL_CORRUPT).
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
  /// Reads and checks nothing else of the model. Errors: those of Find.
  absl::StatusOr<std::vector<double>> Eigenvalues(const std::string& digest);

  /// Returns the models, newest first, at most 1000 a page. A `page_size` of 0 means 100. A page
  /// also ends when its headers together have kMaxHeaderBytes. Errors: InvalidArgument
  /// (INVALID_SETTINGS).
  absl::StatusOr<ModelPage> List(const ModelFilter& filter, int page_size,
                                 const std::string& page_token);

  /// Keeps the material for the model of this digest, which need not be stored yet. The material
  /// replaces an older one. It is durable on return.
  absl::Status RememberMaterial(const std::string& digest, const v1::Material& material);

  /// Returns the material that RememberMaterial stored, or nothing if there is none.
  absl::StatusOr<std::optional<v1::Material>> Material(const std::string& digest);

  /// Changes a model, and returns it without its arrays. Errors: NotFound (MODAL_MODEL_NOT_FOUND),
  /// InvalidArgument (INVALID_SETTINGS), DataLoss (MODAL_MODEL_CORRUPT), ResourceExhausted
  /// (TOO_MANY_TAGS).
  absl::StatusOr<ModelSummary> Update(const std::string& digest, const ModelChange& change);

  /// Deletes a model, its tags, its material and its job. Errors: NotFound (MODAL_MODEL_NOT_FOUND).
  absl::Status Delete(const std::string& digest);

  /// Deletes models with their jobs until the arrays of the remaining models fit into
  /// `budget_bytes`. The model that sounded longest ago (or, if it never sounded, was stored
  /// longest ago) is deleted first. Pinned models, models in memory and the spared model are kept.
  absl::StatusOr<Collected> Collect(uint64_t budget_bytes, const CollectSettings& settings = {});

 private:
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
  /// Returns the mutex that is locked while the model is read, so that two objects of one model do
  /// not both read it.
  std::shared_ptr<Mutex> LatchOf(const std::string& digest);
  /// Returns the model if this revision of it is in memory.
  std::shared_ptr<const ModalModel> Cached(const std::string& digest, int64_t revision);
  /// Returns when models sounded last, as far as that is not stored yet.
  std::map<std::string, int64_t> Sounded();
  /// Whether the model is in memory or is being read.
  bool InMemory(const std::string& digest);
  /// Sets the time at which the model sounded last, if that is not stored yet.
  void AddSounded(ModelSummary& summary);

  Database* database_;
  const Clock* clock_;
  ModelBudget budget_;
  // Never locked while the disk is read or written.
  Mutex cache_mutex_;
  std::map<std::string, std::weak_ptr<const ModalModel>> cache_ ABSL_GUARDED_BY(cache_mutex_);
  std::map<std::string, std::weak_ptr<Mutex>> latches_ ABSL_GUARDED_BY(cache_mutex_);
  // When models sounded last. The next collection stores it, because an object that begins to sound
  // must not wait for the disk.
  std::map<std::string, int64_t> sounded_ ABSL_GUARDED_BY(cache_mutex_);
  ReplaceableCallback<const std::string&, const absl::Status&> on_quarantine_;
};

}  // namespace carillon
