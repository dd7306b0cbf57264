// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "server/base/pose.h"

namespace carillon {

/// Gravity changes the speed of a body in a step by no more than this, m/s^2. A body at rest gets
/// the acceleration of gravity, and twice that in each second step; in some games gravity is twice
/// as great as on Earth.
inline constexpr double kMostGravityMPerS2 = 2.5 * 9.81;

/// The poses of objects in the last steps of a simulation, from which the speed of a point of an
/// object before a blow follows.
class RecentPoses {
 public:
  /// A point of an object, and a direction, both in the object's frame.
  struct Ray {
    uint32_t handle = 0;
    Vector3 point_m{};
    Vector3 direction{};  ///< of unit length
  };

  /// Begins the step at simulation time `time_s`. Unless the step `follows` the one before, the
  /// earlier poses are forgotten.
  void Begin(double time_s, bool follows);

  /// Sets the pose of an object in this step. An object with another serial is another one.
  void Move(uint32_t handle, uint64_t serial, const Pose& pose);

  /// Returns the sum of the speeds, m/s, at which the points move against their directions before
  /// the impulses of this step change them, or nothing if the poses do not tell.
  ///
  /// Some engines tell the poses after a step, and others those before it. Therefore the function
  /// takes the faster of two motions, the one to this step's pose and the one to the pose before.
  /// It adds the acceleration of the earlier steps, which is mostly gravity and acts in the step of
  /// the blow, too, unless it is so great that it was another blow. An object keeps its pose in a
  /// step in which it gets none. One that never had a pose is at rest if another has one.
  std::optional<double> ApproachSpeed(std::span<const Ray> rays) const;

 private:
  static constexpr size_t kPoseCount = 4;
  static constexpr size_t kMostObjects = 16'384;

  /// The poses of an object up to the step in which it got its newest one.
  struct Path {
    uint64_t serial = 0;
    uint64_t step = 0;
    size_t count = 0;
    std::array<Pose, kPoseCount> poses{};  // the newest first

    /// Returns the pose in a step, or null if none is known.
    const Pose* At(uint64_t step_number) const;
  };

  /// Returns the speed against the rays in the interval that ended `steps_ago`.
  std::optional<double> Speed(std::span<const Ray> rays, size_t steps_ago) const;

  uint64_t step_ = kPoseCount;
  std::array<double, kPoseCount> times_s_{};  // the times of the last steps, the newest first
  std::map<uint32_t, Path> paths_;
};

}  // namespace carillon
