// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/client_limits.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/block_broadcast.h"
#include "server/base/usable_memory.h"
#include "server/scene/scene_registry.h"
#include "server/synthesis/mixer.h"

namespace carillon {
namespace {

struct Bound {
  const char* name;
  size_t whole;                ///< limit of all clients together
  const char* all_taken = "";  ///< empty if the caller counts the things
};

Bound BoundOf(Holding holding) {
  switch (holding) {
    case Holding::kScene:
      return {"scenes", SceneRegistry::kMaxSceneCount};
    case Holding::kContactStream:
      return {"contact streams", MixerSettings().most_streams};
    case Holding::kListener:
      return {"listeners", BlockBroadcast::kMaxListenerCount};
    case Holding::kUpload:
      return {"uploads", kMaxUploadCount, "uploads and imports run"};
    case Holding::kExport:
      return {"exports", kMaxExportCount, "exports run"};
    case Holding::kBackup:
      return {"backups", kMaxBackupCount, "backups are being made"};
    case Holding::kRenderingMib:
      return {"MiB of renderings", MostRenderingMib(), "MiB are held by renderings"};
    case Holding::kRendering:
      break;
  }
  return {"renderings", kMaxRenderingCount, "traces are being rendered"};
}

}  // namespace

size_t MostRenderingMib() {
  constexpr uint64_t kMost = 2048;
  static const auto most = static_cast<size_t>(std::min(kMost, (UsableMemoryBytes() / 4) >> 20U));
  return most;
}

ClientPlace::~ClientPlace() {
  if (limits_ != nullptr && count_ > 0) limits_->GiveBack(holding_, client_, count_);
}

absl::Status ClientPlace::Grow(size_t count) {
  if (count <= count_) return absl::OkStatus();
  RETURN_IF_ERROR(limits_->Add(holding_, client_, count - count_));
  count_ = count;
  return absl::OkStatus();
}

size_t ClientPlace::most() const { return limits_ == nullptr ? 0 : limits_->MostOf(holding_); }

size_t ClientLimits::MostOf(Holding holding) const {
  return ShareOf(BoundOf(holding).whole, share_);
}

size_t ClientLimits::ShareOf(size_t whole, double share) {
  return std::max<size_t>(1, static_cast<size_t>(static_cast<double>(whole) * share));
}

absl::StatusOr<ClientPlace> ClientLimits::Take(Holding holding, const std::string& client) {
  ClientPlace place(*this, holding, client);
  RETURN_IF_ERROR(place.Grow(1));
  return place;
}

absl::Status ClientLimits::Add(Holding holding, const std::string& client, size_t count) {
  const Bound bound = BoundOf(holding);
  const MutexLock lock(&mutex_);
  auto& held = held_[static_cast<size_t>(holding)];
  if (*bound.all_taken != 0 && CountAll(holding) + count > bound.whole) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_CALLS",
                   absl::StrCat(bound.whole, " ", bound.all_taken, ": try again when one is done"));
  }
  const auto found = held.find(client);
  RETURN_IF_ERROR(Check(bound.name, bound.whole, found == held.end() ? 0 : found->second, count));
  held[client] += count;
  return absl::OkStatus();
}

absl::Status ClientLimits::Check(absl::string_view name, size_t whole, size_t held,
                                 size_t more) const {
  const size_t most = ShareOf(whole, share_);
  if (share_ >= 1 || held + more <= most) return absl::OkStatus();
  const std::string wish =
      held >= most ? " already" : absl::StrCat(", and ", more, " more would exceed ", most);
  return Refusal(absl::StatusCode::kResourceExhausted, "CLIENT_LIMIT_REACHED",
                 absl::StrCat("this client has ", held, " ", name, wish, ", its share of ", whole,
                              ": end some first"));
}

size_t ClientLimits::count(Holding holding) const {
  const MutexLock lock(&mutex_);
  return CountAll(holding);
}

size_t ClientLimits::CountAll(Holding holding) const {
  size_t sum = 0;
  for (const auto& [client, count] : held_[static_cast<size_t>(holding)]) sum += count;
  return sum;
}

void ClientLimits::GiveBack(Holding holding, const std::string& client, size_t count) {
  const MutexLock lock(&mutex_);
  auto& held = held_[static_cast<size_t>(holding)];
  const auto found = held.find(client);
  if ((found->second -= count) == 0) held.erase(found);
}

}  // namespace carillon
