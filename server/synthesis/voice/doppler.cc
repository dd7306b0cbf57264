// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/doppler.h"

#include <algorithm>
#include <cmath>

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

Vector3 PastPositions::StepBefore(double blocks) const noexcept {
  const size_t count = positions_m_.size();
  const auto whole = std::min(static_cast<size_t>(blocks), count - 2);
  return Minus(positions_m_[(newest_ + count - whole - 1) % count],
               positions_m_[(newest_ + count - whole) % count]);
}

SoundPath FindSoundPath(const PastPositions& object, const Vector3& listener_m,
                        const DelayLimits& limits, double delay_frames) noexcept {
  // Newton's method converges for every object that is slower than sound. Where an object comes
  // nearer at more than kFastest times the speed of sound, the steps are those of this speed.
  constexpr int kMostRounds = 12;
  constexpr double kFastest = 0.9;
  // The rounds end when the delay changes by less than this, in frames.
  constexpr double kClose = 1e-4;
  SoundPath path{.delay_frames = std::clamp(delay_frames, limits.least_frames, limits.most_frames)};
  for (int round = 0; round < kMostRounds; ++round) {
    const double blocks = path.delay_frames / static_cast<double>(limits.block_frame_count);
    path.away_m = Minus(object.Before(blocks), listener_m);
    const double distance_m = Length(path.away_m);
    const double excess = distance_m * limits.frames_per_metre - path.delay_frames;
    // The growth of the distance, in frames, with each frame farther in the past.
    const double growth = distance_m > 0 ? Dot(path.away_m, object.StepBefore(blocks)) /
                                               distance_m * limits.frames_per_metre /
                                               static_cast<double>(limits.block_frame_count)
                                         : 0;
    const double before = path.delay_frames;
    path.delay_frames = std::clamp(before + excess / (1 - std::min(growth, kFastest)),
                                   limits.least_frames, limits.most_frames);
    if (std::abs(path.delay_frames - before) < kClose) break;
  }
  return path;
}

}  // namespace carillon
