// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/free_fall.h"

#include <algorithm>
#include <vector>

namespace carillon::motion {
namespace {

/// Accelerations that differ by this share are the same.
constexpr double kSameShare = 0.05;
/// A body at rest accelerates by less than this share of gravity.
constexpr double kRestShare = 0.1;
constexpr size_t kLeastFrames = 3;

Vector AccelerationAt(const BodyMotion& body, const Motion& motion, size_t frame) {
  return body.Impulse(frame) / (body.mass_kg() * motion.frame_s) + motion.gravity_m_per_s2;
}

}  // namespace

FreeFall FindFreeFall(const BodyMotion& body, const Motion& motion, double factor) {
  const Vector wanted = factor * motion.gravity_m_per_s2;
  const size_t last = motion.frame_count() - 1;
  FreeFall fall;
  size_t longest = 0;
  for (size_t first = 1; first < last;) {
    size_t end = first;
    while (end < last &&
           (AccelerationAt(body, motion, end) - wanted).norm() < kSameShare * wanted.norm()) {
      ++end;
    }
    const size_t count = end - first;
    if (count >= kLeastFrames) fall.frame_count += count;
    if (count >= kLeastFrames && count > longest) {
      longest = count;
      fall.frame = first + count / 2;
    }
    first = end + 1;
  }
  return fall;
}

LengthMistake FindLengthMistake(const Motion& motion) {
  const double gravity = motion.gravity_m_per_s2.norm();
  LengthMistake mistake;
  for (size_t i = 0; i < motion.bodies.size(); ++i) {
    const BodyMotion body(motion.bodies[i], motion);
    if (!body.balanced()) continue;
    if (FindFreeFall(body, motion, 1).frame_count > 0) return {};
    for (const double factor : {100.0, 1000.0, 0.01, 0.001}) {
      size_t moving = 0;
      for (size_t k = 1; k + 1 < motion.frame_count(); ++k) {
        const double acceleration = AccelerationAt(body, motion, k).norm();
        if (acceleration > kRestShare * factor * gravity) ++moving;
      }
      // A body that is moved by hand may fall so for some frames, but not for most.
      if (2 * FindFreeFall(body, motion, factor).frame_count > moving) mistake = {factor, i};
    }
  }
  return mistake;
}

}  // namespace carillon::motion
