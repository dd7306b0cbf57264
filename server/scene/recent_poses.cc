// SPDX-License-Identifier: Apache-2.0
#include "server/scene/recent_poses.h"

#include <algorithm>
#include <cmath>

#include "server/synthesis/voice/vector3.h"

namespace carillon {

void RecentPoses::Begin(double time_s, bool follows) {
  if (!follows || paths_.size() > kMostObjects) paths_.clear();
  ++step_;
  std::ranges::copy_backward(times_s_.begin(), times_s_.end() - 1, times_s_.end());
  times_s_[0] = time_s;
}

void RecentPoses::Move(uint32_t handle, uint64_t serial, const Pose& pose) {
  Path& path = paths_[handle];
  if (path.serial != serial) path = {.serial = serial};
  // In the steps without a pose, the object had the pose before.
  const uint64_t passed = path.count == 0 ? 1 : std::min<uint64_t>(step_ - path.step, kPoseCount);
  for (uint64_t i = 0; i < passed; ++i) {
    std::ranges::copy_backward(path.poses.begin(), path.poses.end() - 1, path.poses.end());
  }
  path.count = std::min<size_t>(path.count + passed, kPoseCount);
  path.step = step_;
  path.poses[0] = {.position_m = pose.position_m, .orientation = Normalized(pose.orientation)};
}

const Pose* RecentPoses::Path::At(uint64_t step_number) const {
  const uint64_t steps_ago = step - std::min(step, step_number);
  return steps_ago < count ? &poses[steps_ago] : nullptr;
}

std::optional<double> RecentPoses::Speed(std::span<const Ray> rays, size_t steps_ago) const {
  const double interval_s = times_s_[steps_ago] - times_s_[steps_ago + 1];
  if (!(interval_s > 0)) return std::nullopt;
  const auto place = [](const Ray& ray, const Pose& pose) {
    Vector3 at = Rotated(ray.point_m, pose.orientation);
    for (size_t axis = 0; axis < 3; ++axis) at[axis] += pose.position_m[axis];
    return at;
  };
  double approach_m = 0;
  bool known = false;
  for (const Ray& ray : rays) {
    const auto found = paths_.find(ray.handle);
    if (found == paths_.end()) continue;
    const Pose* to = found->second.At(step_ - steps_ago);
    const Pose* from = found->second.At(step_ - steps_ago - 1);
    if (to == nullptr || from == nullptr) return std::nullopt;
    approach_m += Dot(Minus(place(ray, *from), place(ray, *to)),
                      Rotated(ray.direction, found->second.poses[0].orientation));
    known = true;
  }
  return known ? std::optional(approach_m / interval_s) : std::nullopt;
}

std::optional<double> RecentPoses::ApproachSpeed(std::span<const Ray> rays) const {
  const std::optional<double> now = Speed(rays, 0), before = Speed(rays, 1);
  if (!before) return std::nullopt;
  const double gained = *before - Speed(rays, 2).value_or(*before);
  const double most = kMostGravityMPerS2 * (times_s_[1] - times_s_[2]);
  return std::max(now.value_or(*before), *before) + (std::abs(gained) <= most ? gained : 0);
}

}  // namespace carillon
