// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/stems.h"

#include <algorithm>
#include <utility>

namespace carillon {

absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> Stems::Subscribe(
    BusId bus, std::function<void()> wake) {
  const MutexLock lock(&mutex_);
  const auto found = std::ranges::find_if(stems_, [bus](const std::unique_ptr<Stem>& stem) {
    return stem->bus == bus && !stem->closed && stem->left_frame == 0;
  });
  if (found != stems_.end()) return (*found)->broadcast.Subscribe(std::move(wake));
  Stem& stem = *stems_.emplace_back(std::make_unique<Stem>(bus, format_, queue_block_count_));
  mixer_.Tap(bus, &stem);
  return stem.broadcast.Subscribe(std::move(wake));
}

void Stems::Deliver() {
  const MutexLock lock(&mutex_);
  for (const std::unique_ptr<Stem>& stem : stems_) stem->broadcast.Deliver();
  std::erase_if(stems_, [this](const std::unique_ptr<Stem>& stem) { return IsFree(*stem); });
}

bool Stems::has_listeners() const {
  const MutexLock lock(&mutex_);
  return std::ranges::any_of(stems_,
                             [](const auto& stem) { return stem->broadcast.listener_count() > 0; });
}

/// Returns whether a stem may be freed, because it has no listener and the mixer has finished the
/// last block that may use the stem.
bool Stems::IsFree(Stem& stem) const {
  if (stem.broadcast.listener_count() > 0) return false;
  if (stem.left_frame == 0) {
    if (!stem.closed) mixer_.Tap(stem.bus, nullptr);
    stem.left_frame = mixer_.frame() + 1;
    return false;
  }
  return mixer_.frame() > stem.left_frame + format_.block_frame_count;
}

}  // namespace carillon
