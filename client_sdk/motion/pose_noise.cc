// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/pose_noise.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "client_sdk/motion/kinematics.h"

namespace carillon::motion {
namespace {

/// Changes of velocity by noise, m/s along an axis, among which the search for contacts finds few:
/// a pile of blocks at 240 frames a second has 20 % of false impulse at 0.007, and 400 % at 0.014.
constexpr double kFaintSpeed = 0.012;
/// Frames of this distance, s, still tell most blows apart.
constexpr double kLongestFrame = 0.05;
/// A body may turn by this angle, rad, between two frames.
constexpr double kMostTurnApart = 1.5;

using Change = Eigen::Matrix<double, 6, 1>;

/// The differences of neighbouring changes of velocity, of the centre and of the surface as it
/// turns. A constant force has none.
std::vector<Change> Differences(const BodyMotion& body, size_t frames) {
  std::vector<Change> changes;
  for (size_t k = 1; k + 1 < frames; ++k) {
    changes.emplace_back() << body.Impulse(k) / body.mass_kg(),
        body.radius_m() * (body.InverseInertia(k) * body.Torque(k));
  }
  std::adjacent_difference(changes.begin(), changes.end(), changes.begin());
  if (!changes.empty()) changes.erase(changes.begin());
  return changes;
}

/// Returns the standard deviation, m/s along one axis, of the change of the velocity of a body's
/// surface that noise feigns at a frame. White noise s of a coordinate changes velocities by
/// sqrt(6) s/h, and two successive changes differ by sqrt(20) s/h. Successive differences have the
/// correlation -15/20; those of an impulse at a time within a frame have -1/2 to 0, on average
/// -1/3.
double NoiseSpeed(const BodyMotion& body, size_t frames) {
  constexpr size_t kWindow = 3, kLeastWindows = 8;
  constexpr double kLeastOpposite = 0.45;
  const std::vector<Change> differences = Differences(body, frames);
  struct Window {
    double energy = 0, product = 0;
  };
  std::vector<Window> windows;
  for (size_t k = 0; k + kWindow <= differences.size(); ++k) {
    const Change* c = &differences[k];
    const Window window = {(c[0].squaredNorm() + c[1].squaredNorm() + c[2].squaredNorm()) / 3,
                           (c[0].dot(c[1]) + c[1].dot(c[2])) / 2};
    // FindContacts refuses poses and inertias that are malformed.
    if (std::isfinite(window.energy)) windows.push_back(window);
  }
  if (windows.size() < kLeastWindows) return 0;
  // The louder ones may hold impulses.
  std::ranges::sort(windows, {}, &Window::energy);
  windows.resize(windows.size() / 3);
  double energy = 0, product = 0;
  for (const Window& window : windows) {
    energy += window.energy;
    product += window.product;
  }
  if (-product < kLeastOpposite * energy) return 0;
  return std::sqrt(6.0 / 20 * windows.back().energy / 3);
}

}  // namespace

PoseNoise MeasureNoise(const Motion& motion) {
  if (motion.frames_are_steps || 2 * motion.frame_s > kLongestFrame) return {};
  double speed = 0, turn = 0;
  for (const MovingBody& body : motion.bodies) {
    for (size_t k = 0; k + 1 < body.poses.size(); ++k) {
      turn =
          std::max(turn, body.poses[k].orientation.angularDistance(body.poses[k + 1].orientation));
    }
    if (body.poses.size() < 2 || body.mass_kg <= 0) continue;
    speed = std::max(speed, NoiseSpeed(BodyMotion(body, motion), body.poses.size()));
  }
  double most =
      std::min(kLongestFrame / motion.frame_s, static_cast<double>(motion.frame_count()) / 8);
  if (turn > 0) most = std::min(most, kMostTurnApart / turn);
  most = std::max(1.0, most);
  const double wanted = std::max(1.0, std::ceil(speed / kFaintSpeed));
  return {.place_m = speed * motion.frame_s / std::sqrt(6.0),
          .frames_apart = static_cast<size_t>(std::min(wanted, most)),
          .suffices = wanted <= most};
}

void TakeEach(size_t n, std::vector<BodyPose>& poses) {
  size_t kept = 0;
  for (size_t k = 0; k < poses.size(); k += n) poses[kept++] = poses[k];
  poses.resize(kept);
}

void TakeEach(size_t n, Motion& motion) {
  for (MovingBody& body : motion.bodies) TakeEach(n, body.poses);
  motion.frame_s *= static_cast<double>(n);
}

}  // namespace carillon::motion
