// SPDX-License-Identifier: Apache-2.0
//
// The garbage collections of ModelStore.

#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database.h"
#include "server/mode_database/model_sql.h"
#include "server/mode_database/model_store.h"

namespace carillon {

namespace {

absl::Status WriteSounded(SqliteConnection& connection,
                          const std::map<std::string, int64_t>& sounded) {
  for (const auto& [digest, unix_ms] : sounded) {
    RETURN_IF_ERROR(StoreSounded(connection, digest, unix_ms));
  }
  return absl::OkStatus();
}

}  // namespace

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
