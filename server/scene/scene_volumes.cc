// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_volumes.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {

absl::Status ValidateGain(double gain) {
  constexpr double kLargestGain = 1000;
  if (gain >= 0 && gain <= kLargestGain) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("the gain is ", gain, "; it must be 0 to ", kLargestGain,
                              ", linear: 0.5 is 6 dB less"));
}

absl::StatusOr<BusId> SceneVolumes::Open(uint64_t scene, const std::string& owner, double gain) {
  RETURN_IF_ERROR(ValidateGain(gain));
  const MutexLock lock(&mutex_);
  Entry entry{.bus = {}, .owner = owner, .volume = {.gain = gain}};
  ASSIGN_OR_RETURN(entry.bus, mixer_.OpenBus(HeardGain(entry)));
  entries_[scene] = entry;
  return entry.bus;
}

void SceneVolumes::Close(uint64_t scene) {
  const MutexLock lock(&mutex_);
  const auto found = entries_.find(scene);
  if (found == entries_.end()) return;
  mixer_.CloseBus(found->second.bus);
  entries_.erase(found);
  Apply();
}

absl::Status SceneVolumes::Change(uint64_t scene, const SceneVolumeChange& change) {
  if (change.gain) RETURN_IF_ERROR(ValidateGain(*change.gain));
  const MutexLock lock(&mutex_);
  const auto found = entries_.find(scene);
  if (found == entries_.end()) return absl::OkStatus();  // the scene was deleted meanwhile
  SceneVolume& volume = found->second.volume;
  volume.gain = change.gain.value_or(volume.gain);
  volume.muted = change.muted.value_or(volume.muted);
  volume.solo = change.solo.value_or(volume.solo);
  Apply();
  return absl::OkStatus();
}

SceneVolume SceneVolumes::volume(uint64_t scene) const {
  const MutexLock lock(&mutex_);
  const auto found = entries_.find(scene);
  return found == entries_.end() ? SceneVolume() : found->second.volume;
}

double SceneVolumes::HeardGain(const Entry& entry) const {
  const bool another_solo = std::ranges::any_of(entries_, [&entry](const auto& other) {
    return other.second.owner == entry.owner && other.second.volume.solo;
  });
  const bool heard = !entry.volume.muted && (entry.volume.solo || !another_solo);
  return heard ? entry.volume.gain : 0;
}

void SceneVolumes::Apply() {
  for (const auto& [scene, entry] : entries_) mixer_.SetGain(entry.bus, HeardGain(entry));
}

}  // namespace carillon
