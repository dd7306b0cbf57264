// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/doppler.h"

#include <algorithm>

#include "server/synthesis/voice/vector3.h"

namespace carillon {

void PastPositions::Add(const Vector3& position_m) noexcept {
  newest_ = (newest_ + 1) % positions_m_.size();
  positions_m_[newest_] = position_m;
}

void PastPositions::Fill(const Vector3& position_m) noexcept {
  std::ranges::fill(positions_m_, position_m);
}

Vector3 PastPositions::Before(double blocks) const noexcept {
  const size_t count = positions_m_.size();
  const auto whole = std::min(static_cast<size_t>(blocks), count - 2);
  const double part = std::min(blocks - static_cast<double>(whole), 1.0);
  const Vector3& after = positions_m_[(newest_ + count - whole) % count];
  const Vector3& before = positions_m_[(newest_ + count - whole - 1) % count];
  return {after[0] + part * (before[0] - after[0]), after[1] + part * (before[1] - after[1]),
          after[2] + part * (before[2] - after[2])};
}

SoundPath FindSoundPath(const PastPositions& object, const Vector3& listener_m,
                        const DelayLimits& limits, double delay_frames) noexcept {
  // Each round reduces the error by the ratio of the object's speed to the speed of sound.
  constexpr int kRounds = 5;
  SoundPath path{.delay_frames = delay_frames};
  for (int round = 0; round < kRounds; ++round) {
    const double blocks = path.delay_frames / static_cast<double>(limits.block_frame_count);
    path.away_m = Minus(object.Before(blocks), listener_m);
    path.delay_frames = std::clamp(Length(path.away_m) * limits.frames_per_metre,
                                   limits.least_frames, limits.most_frames);
  }
  return path;
}

}  // namespace carillon
