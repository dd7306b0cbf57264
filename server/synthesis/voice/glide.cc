// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/glide.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carillon {
namespace {

constexpr double kLagS = 0.01;
/// Within this distance, in metres, the smoothed place snaps to the target.
constexpr double kNear = 1e-7;
/// The first of the axes of the orientation.
constexpr size_t kFirstOfTurn = 6;

}  // namespace

Glide::Glide(const Place& place, double sample_rate_hz, size_t block_frame_count)
    : smoothing_(-std::expm1(-static_cast<double>(block_frame_count) / (kLagS * sample_rate_hz))),
      block_frame_count_(block_frame_count) {
  std::ranges::copy(place.position_m, unsmoothed_.begin());
  std::ranges::copy(place.right, unsmoothed_.begin() + 3);
  const Quaternion& q = place.orientation;
  std::ranges::copy(std::array{q.w, q.x, q.y, q.z}, unsmoothed_.begin() + kFirstOfTurn);
  target_ = smoothed_ = unsmoothed_;
}

void Glide::Move(const Motion& motion, size_t offset) noexcept {
  Go(offset - std::min(offset_, offset));
  offset_ = std::max(offset_, offset);
  std::ranges::copy(motion.position_m, target_.begin());
  std::ranges::copy(motion.right, target_.begin() + 3);
  const auto [x, y, z] = motion.orientation;
  const double w = std::sqrt(std::max(0.0, 1 - double{x} * x - double{y} * y - double{z} * z));
  const std::array<double, 4> turn = {w, x, y, z};
  // A quaternion and its negative are the same orientation; the nearer of the two is the target.
  double nearness = 0;
  for (size_t i = 0; i < turn.size(); ++i) nearness += turn[i] * unsmoothed_[kFirstOfTurn + i];
  for (size_t i = 0; i < turn.size(); ++i) {
    target_[kFirstOfTurn + i] = nearness < 0 ? -turn[i] : turn[i];
  }
  at_rest_ = false;
  frames_left_ = motion.glide_frames;
  if (frames_left_ >= 1) {
    for (size_t i = 0; i < kAxes; ++i) step_[i] = (target_[i] - unsmoothed_[i]) / frames_left_;
    return;
  }
  frames_left_ = 0;
  unsmoothed_ = target_;
  jumps_ = true;
}

void Glide::Go(size_t frame_count) noexcept {
  if (frames_left_ == 0) return;
  const auto frames = static_cast<double>(frame_count);
  if (frames >= frames_left_) {
    unsmoothed_ = target_;
    frames_left_ = 0;
    return;
  }
  for (size_t i = 0; i < kAxes; ++i) unsmoothed_[i] += frames * step_[i];
  frames_left_ -= frames;
}

void Glide::Advance() noexcept {
  Go(block_frame_count_ - offset_);
  offset_ = 0;
  jumped_ = std::exchange(jumps_, false);
  if (jumped_) smoothed_ = unsmoothed_;
  at_rest_ = frames_left_ == 0;
  for (size_t i = 0; i < kAxes; ++i) {
    const double left = unsmoothed_[i] - smoothed_[i];
    smoothed_[i] += smoothing_ * left;
    at_rest_ &= std::abs(left) < kNear;
  }
  if (at_rest_) smoothed_ = unsmoothed_;
}

Place Glide::PlaceAt(const Coordinates& coordinates) noexcept {
  Place place;
  std::copy_n(coordinates.begin(), 3, place.position_m.begin());
  std::copy_n(coordinates.begin() + 3, 3, place.right.begin());
  const double* turn = coordinates.data() + kFirstOfTurn;
  const Quaternion q{turn[0], turn[1], turn[2], turn[3]};
  // Half-way through half a turn the interpolated quaternion can be zero.
  if (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z > kNear) place.orientation = Normalized(q);
  return place;
}

}  // namespace carillon
