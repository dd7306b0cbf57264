// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "client_sdk/motion/motion.h"
#include "client_sdk/motion/surface_index.h"

namespace carillon::motion {

/// A place at which two bodies may touch: a corner and a face, or two edges.
struct ContactFeature {
  uint64_t key = 0;                 ///< the same for the same corner or pair of edges
  Vector point_a = Vector::Zero();  ///< in a's frame, on its surface
  Vector point_b = Vector::Zero();  ///< in b's frame
  Vector normal = Vector::Zero();   ///< from b to a, in the scene's axes
  double gap_m = 0;
  bool round = false;  ///< the corner is one of a round surface
};

/// Two bodies at an instant, by the poses of their frames.
struct PairPlacement {
  BodyPose a, b;
};

/// Returns the places at which two bodies that lie so may touch: their gaps are at most `reach_m`.
/// If `beyond_m` is given, the gaps of round surfaces exceed the least gap by at most `beyond_m`,
/// since round surfaces touch where they are nearest, however they turn; the gaps of other surfaces
/// exceed it by at most `reach_m`. If there are too many places for the solver, those that are
/// farthest apart are returned.
std::vector<ContactFeature> FindFeatures(const SurfaceIndex& a, const SurfaceIndex& b,
                                         const PairPlacement& at, double reach_m,
                                         std::optional<double> beyond_m);

}  // namespace carillon::motion
