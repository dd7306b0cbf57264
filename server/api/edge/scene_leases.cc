// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/scene_leases.h"

#include <algorithm>

namespace carillon {

void SceneLeases::Begin(uint64_t scene, const std::string& connection, bool keep) {
  const MutexLock lock(&mutex_);
  leases_[scene] = {.keep = keep, .connections = {connection}};
}

void SceneLeases::Use(uint64_t scene, const std::string& connection) {
  const MutexLock lock(&mutex_);
  const auto lease = leases_.find(scene);
  if (lease == leases_.end()) return;
  lease->second.connections.insert(connection);
  lease->second.abandoned.reset();
}

void SceneLeases::End(uint64_t scene) {
  const MutexLock lock(&mutex_);
  leases_.erase(scene);
}

std::vector<uint64_t> SceneLeases::Expired() {
  const MutexLock lock(&mutex_);
  std::vector<uint64_t> expired;
  for (auto& [scene, lease] : leases_) {
    Update(lease);
    if (lease.keep || !lease.abandoned) continue;
    if (clock_.Monotonic() - *lease.abandoned >= grace_) expired.push_back(scene);
  }
  return expired;
}

std::optional<uint64_t> SceneLeases::LongestAbandoned(
    const std::function<bool(uint64_t scene)>& among) {
  const MutexLock lock(&mutex_);
  std::optional<uint64_t> longest;
  std::chrono::nanoseconds since = std::chrono::nanoseconds::max();
  for (auto& [scene, lease] : leases_) {
    Update(lease);
    if (lease.keep || !lease.abandoned || *lease.abandoned >= since || !among(scene)) continue;
    longest = scene;
    since = *lease.abandoned;
  }
  return longest;
}

LeaseState SceneLeases::StateOf(uint64_t scene) {
  const MutexLock lock(&mutex_);
  const auto found = leases_.find(scene);
  if (found == leases_.end()) return {};
  Lease& lease = found->second;
  Update(lease);
  LeaseState state{.keep = lease.keep, .connection_count = lease.connections.size()};
  if (!lease.keep && lease.abandoned) {
    const std::chrono::nanoseconds left = grace_ - (clock_.Monotonic() - *lease.abandoned);
    state.ends_in_s = std::max(0.0, std::chrono::duration<double>(left).count());
  }
  return state;
}

void SceneLeases::Update(Lease& lease) {
  std::erase_if(lease.connections,
                [this](const auto& connection) { return !is_open_(connection); });
  if (lease.connections.empty() && !lease.abandoned) lease.abandoned = clock_.Monotonic();
}

}  // namespace carillon
