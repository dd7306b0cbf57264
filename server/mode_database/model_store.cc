// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/model_store.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/mode_database/codec/model_codec.h"
#include "server/mode_database/database.h"
#include "server/mode_database/model_export.h"
#include "server/mode_database/model_import.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/page_token.h"
#include "server/mode_database/spool_file.h"
#include "server/mode_database/utf8_prefix.h"

namespace carillon {
namespace {

constexpr size_t kMaxTagBytes = 64;

absl::Status CheckName(const std::string& digest) {
  if (IsSha256Hex(digest)) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_NAME",
                 "a modal model is named modalModels/ and 64 lower-case hexadecimal digits");
}

absl::Status CheckTag(const std::string& tag) {
  const bool fits =
      !tag.empty() && tag.size() <= kMaxTagBytes && std::ranges::all_of(tag, [](unsigned char c) {
        return absl::ascii_isalnum(c) ||
               absl::string_view("._:/+-").find(static_cast<char>(c)) != absl::string_view::npos;
      });
  if (fits) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("\"", tag, "\" is no tag: give one to ", kMaxTagBytes,
                              " letters, digits or any of . _ : / + -"));
}

ModelSummary Named(const std::string& digest, const std::string& label) {
  ModelSummary summary;
  summary.digest = digest;
  summary.label = Utf8Prefix(label, kMaxLabelBytes);
  return summary;
}

absl::Status WriteSounded(SqliteConnection& connection,
                          const std::map<std::string, int64_t>& sounded) {
  for (const auto& [digest, unix_ms] : sounded) {
    RETURN_IF_ERROR(StoreSounded(connection, digest, unix_ms));
  }
  return absl::OkStatus();
}

}  // namespace

void ModelStore::ListenToQuarantine(OnQuarantine on_quarantine) {
  on_quarantine_.Replace(std::move(on_quarantine));
}

// Returns `why`, or the error that kept the model out of quarantine.
absl::Status ModelStore::Quarantine(const std::string& digest, const absl::Status& why) {
  bool news = false;
  RETURN_IF_ERROR(database_->Write([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(news, QuarantineModel(connection, digest));
    return absl::OkStatus();
  }));
  if (news) on_quarantine_.Call(digest, why);
  return why;
}

absl::StatusOr<ModelSummary> ModelStore::Store(
    absl::FunctionRef<absl::StatusOr<ModelFileReader>()> open, ModelSummary named,
    Replacing replacing, bool* kept) {
  named.created_unix_ms = clock_->UnixMs();
  ModelSummary summary;
  RETURN_IF_ERROR(database_->Write([&](SqliteConnection& connection) {
    summary = named;
    if (replacing != Replacing::kAlways) {
      ASSIGN_OR_RETURN(ModelFileReader sent, open());
      ASSIGN_OR_RETURN(*kept, IsStored(connection, sent, replacing, summary));
      if (*kept) return absl::OkStatus();
    }
    ASSIGN_OR_RETURN(ModelFileReader records, open());
    return InsertModel(connection, records, summary);
  }));
  if (budget_.bytes > 0) CollectBeyondBudget(summary.digest);
  return summary;
}

absl::StatusOr<ModelSummary> ModelStore::PutFile(const std::string& digest,
                                                 const std::string& label,
                                                 const std::filesystem::path& file) {
  RETURN_IF_ERROR(CheckName(digest));
  return Store([&] { return ModelFileReader::Open(file); }, Named(digest, label),
               Replacing::kAlways, nullptr);
}

absl::Status ModelStore::CopyIfAbsent(const std::string& from, const std::string& to,
                                      const std::string& label) {
  RETURN_IF_ERROR(CheckName(to));
  return database_->Write([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(ModelSummary summary, SelectModel(connection, from));
    const absl::StatusOr<ModelSummary> there = SelectModel(connection, to);
    if (!absl::IsNotFound(there.status())) return there.status();
    summary.label = Utf8Prefix(label, kMaxLabelBytes);
    summary.created_unix_ms = clock_->UnixMs();
    return InsertCopy(connection, to, summary);
  });
}

absl::StatusOr<ModelImport> ModelStore::Import(const std::string& digest, const std::string& label,
                                               Replacing replacing) {
  if (const absl::Status status = CheckName(digest); !digest.empty() && !status.ok()) return status;
  ASSIGN_OR_RETURN(SpoolFile file, database_->MakeSpool());
  return ModelImport(std::move(file), Named(digest, label),
                     [this, replacing](absl::FunctionRef<absl::StatusOr<ModelFileReader>()> open,
                                       const ModelSummary& named, bool& kept) {
                       return Store(open, named, replacing, &kept);
                     });
}

absl::StatusOr<ModelExport> ModelStore::Export(const std::string& digest) {
  ASSIGN_OR_RETURN(ModelSummary summary, Summary(digest));
  return ModelExport::Begin(
      *database_, std::move(summary),
      [this, digest](const absl::Status& why) { return Quarantine(digest, why); });
}

absl::StatusOr<std::shared_ptr<const ModalModel>> ModelStore::Find(const std::string& digest) {
  auto model = Load(digest);
  if (absl::IsDataLoss(model.status())) return Quarantine(digest, model.status());
  return model;
}

absl::StatusOr<std::shared_ptr<const ModalModel>> ModelStore::FindToSound(
    const std::string& digest) {
  auto model = Find(digest);
  MutexLock lock(&cache_mutex_);
  if (model.ok()) sounded_[digest] = clock_->UnixMs();
  return model;
}

std::shared_ptr<Mutex> ModelStore::LatchOf(const std::string& digest) {
  const MutexLock lock(&cache_mutex_);
  std::erase_if(latches_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<Mutex>& known = latches_[digest];
  std::shared_ptr<Mutex> latch = known.lock();
  if (latch == nullptr) known = latch = std::make_shared<Mutex>();
  return latch;
}

std::shared_ptr<const ModalModel> ModelStore::Cached(const std::string& digest, int64_t revision) {
  const MutexLock lock(&cache_mutex_);
  const auto cached = cache_.find(digest);
  std::shared_ptr<const ModalModel> model;
  if (cached != cache_.end()) model = cached->second.lock();
  return model != nullptr && model->revision == revision ? model : nullptr;
}

absl::StatusOr<std::shared_ptr<const ModalModel>> ModelStore::Load(const std::string& digest) {
  const std::shared_ptr<Mutex> latch = LatchOf(digest);
  const MutexLock one_reader(latch.get());
  std::shared_ptr<const ModalModel> model;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(const ModelSummary row, SelectModel(connection, digest));
    model = Cached(digest, row.revision);
    if (model != nullptr) return absl::OkStatus();
    ASSIGN_OR_RETURN(ModalModel read, ReadModel(connection, row));
    read.revision = row.revision;
    model = std::make_shared<const ModalModel>(std::move(read));
    return absl::OkStatus();
  }));
  const MutexLock lock(&cache_mutex_);
  std::erase_if(cache_, [](const auto& entry) { return entry.second.expired(); });
  cache_[digest] = model;
  return model;
}

absl::StatusOr<ModelSummary> ModelStore::Summary(const std::string& digest) {
  absl::StatusOr<ModelSummary> summary = ModelNotFound(digest);
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    summary = SelectModel(connection, digest);
    return summary.status();
  }));
  AddSounded(*summary);
  return summary;
}

void ModelStore::AddSounded(ModelSummary& summary) {
  const MutexLock lock(&cache_mutex_);
  const auto sounded = sounded_.find(summary.digest);
  if (sounded != sounded_.end()) summary.sounded_unix_ms = sounded->second;
}

absl::StatusOr<std::vector<double>> ModelStore::Eigenvalues(const std::string& digest) {
  std::vector<double> eigenvalues;
  absl::Status status = database_->Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(const ModelSummary summary, SelectModel(connection, digest));
    ASSIGN_OR_RETURN(eigenvalues, ReadEigenvalues(connection, summary));
    return absl::OkStatus();
  });
  if (absl::IsDataLoss(status)) return Quarantine(digest, status);
  RETURN_IF_ERROR(status);
  return eigenvalues;
}

absl::StatusOr<ModelPage> ModelStore::List(const ModelFilter& filter, int page_size,
                                           const std::string& page_token) {
  ASSIGN_OR_RETURN(const PageRange range, ParsePage("models", page_size, page_token));
  ModelPage page;
  bool is_full = false;
  std::vector<std::pair<std::string, absl::Status>> damaged;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(is_full,
                     SelectModels(
                         connection, filter, range.below, range.size,
                         [&](ModelSummary model) { page.models.push_back(std::move(model)); },
                         [&](std::string digest, absl::Status why) {
                           damaged.emplace_back(std::move(digest), std::move(why));
                         }));
    return absl::OkStatus();
  }));
  for (const auto& [digest, why] : damaged) Quarantine(digest, why).IgnoreError();
  for (ModelSummary& model : page.models) AddSounded(model);
  // Damaged models are left out of the page, which makes it shorter but not the last one.
  is_full |= std::ssize(page.models) + std::ssize(damaged) == range.size;
  if (is_full && !page.models.empty()) {
    page.next_page_token = PageToken("models", page.models.back().revision);
  }
  return page;
}

absl::Status ModelStore::RememberMaterial(const std::string& digest, const v1::Material& material) {
  ASSIGN_OR_RETURN(const std::optional<v1::Material> known, Material(digest));
  // A request that is repeated waits for no disk.
  const std::string bytes = material.SerializeAsString();
  if (known.has_value() && known->SerializeAsString() == bytes) return absl::OkStatus();
  return database_->Write(
      [&](SqliteConnection& connection) { return StoreMaterial(connection, digest, material); });
}

absl::StatusOr<std::optional<v1::Material>> ModelStore::Material(const std::string& digest) {
  std::optional<v1::Material> material;
  RETURN_IF_ERROR(database_->Read([&](SqliteConnection& connection) {
    ASSIGN_OR_RETURN(material, SelectMaterial(connection, digest));
    return absl::OkStatus();
  }));
  return material;
}

absl::StatusOr<ModelSummary> ModelStore::Update(const std::string& digest,
                                                const ModelChange& change) {
  absl::StatusOr<ModelSummary> summary = ModelNotFound(digest);
  RETURN_IF_ERROR(database_->Write([&](SqliteConnection& connection) {
    summary = SelectModel(connection, digest);
    RETURN_IF_ERROR(summary.status());
    if (change.add_tags.size() > kMaxTagCount) return TooManyTags(digest, change.add_tags.size());
    for (const std::string& tag : change.add_tags) RETURN_IF_ERROR(CheckTag(tag));
    RETURN_IF_ERROR(UpdateModel(connection, digest, change));
    summary = SelectModel(connection, digest);
    return summary.status();
  }));
  return summary;
}

absl::Status ModelStore::Delete(const std::string& digest) {
  return database_->WriteToFree(
      [&](SqliteConnection& connection) { return DeleteModelRows(connection, digest); });
}

bool ModelStore::InMemory(const std::string& digest) {
  const MutexLock lock(&cache_mutex_);
  const auto cached = cache_.find(digest);
  const auto latch = latches_.find(digest);
  return (cached != cache_.end() && !cached->second.expired()) ||
         (latch != latches_.end() && !latch->second.expired());
}

std::map<std::string, int64_t> ModelStore::Sounded() {
  const MutexLock lock(&cache_mutex_);
  return sounded_;
}

void ModelStore::CollectBeyondBudget(const std::string& newest) {
  const auto log_deleted = [this](const std::string& digest, uint64_t bytes) {
    budget_.log_event(Event("model_deleted")
                          .With("model", absl::StrCat("modalModels/", digest))
                          .With("bytes", bytes)
                          .With("cause", "budget"));
  };
  const absl::StatusOr<Collected> collected =
      Collect(budget_.bytes, {.spared = newest, .on_deleted = log_deleted});
  if (!collected.ok()) return budget_.log(std::string(collected.status().message()));
  if (collected->model_count == 0) return;
  budget_.log_event(Event("models_collected")
                        .With("count", collected->model_count)
                        .With("bytes", collected->bytes)
                        .With("cause", "budget")
                        .With("budget_bytes", budget_.bytes));
}

absl::StatusOr<Collected> ModelStore::Collect(uint64_t budget_bytes,
                                              const CollectSettings& settings) {
  // The log of a full disk has room for the deletion of a few models at a time.
  const size_t most = settings.dry_run ? std::numeric_limits<size_t>::max() : 16;
  Collected all;
  Collected some;
  do {
    ASSIGN_OR_RETURN(some, CollectSome(budget_bytes, settings, most));
    all = {all.model_count + some.model_count, all.bytes + some.bytes};
  } while (some.model_count == most);
  return all;
}

absl::StatusOr<Collected> ModelStore::CollectSome(uint64_t budget_bytes,
                                                  const CollectSettings& settings, size_t most) {
  Collected collected;
  std::vector<ModelSize> deleted;
  std::map<std::string, int64_t> stored;
  const auto collect = [&](SqliteConnection& connection) {
    collected = {};
    deleted.clear();
    stored = Sounded();
    RETURN_IF_ERROR(WriteSounded(connection, stored));
    std::vector<ModelSize> oldest_first;
    uint64_t total_bytes = 0;
    RETURN_IF_ERROR(SelectSizes(connection, [&](const ModelSize& model) {
      oldest_first.push_back(model);
      total_bytes += model.bytes;
    }));
    for (const ModelSize& model : oldest_first) {
      if (total_bytes <= budget_bytes || collected.model_count == most) break;
      if (model.pinned || model.digest == settings.spared || InMemory(model.digest)) continue;
      if (!settings.dry_run) {
        RETURN_IF_ERROR(DeleteModelRows(connection, model.digest));
        deleted.push_back(model);
      }
      total_bytes -= model.bytes;
      collected = {collected.model_count + 1, collected.bytes + model.bytes};
    }
    return absl::OkStatus();
  };
  RETURN_IF_ERROR(database_->WriteToFree(collect));
  for (const ModelSize& model : deleted) settings.on_deleted(model.digest, model.bytes);
  const MutexLock lock(&cache_mutex_);
  std::erase_if(sounded_, [&](const auto& entry) {
    const auto same = stored.find(entry.first);
    return same != stored.end() && same->second == entry.second;
  });
  return collected;
}

}  // namespace carillon
