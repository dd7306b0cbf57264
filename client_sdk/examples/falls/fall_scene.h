// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon::falls {

using Vector = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  ///< w, x, y, z

/// The half space below z = 0 of the body's frame.
struct Plane {};

struct Ball {
  double radius_m = 0;
};

/// A box somewhere in the frame of its body.
struct Box {
  Vector sides_m{};
  Vector position_m{};
  Quaternion orientation{1, 0, 0, 0};
};

/// The corners of a convex body.
struct Hull {
  std::vector<Vector> corners_m;
};

/// A body of a fall. The origin of its frame is its centre of mass, the axes are those of inertia.
struct Body {
  std::string name;
  std::variant<Plane, Ball, std::vector<Box>, Hull> shape;
  double mass_kg = 0;  ///< zero: fixed
  Vector inertia_kg_m2{};
  Vector position_m{};
  Quaternion orientation{1, 0, 0, 0};
  Vector velocity_m_per_s{};
  Vector angular_velocity_rad_per_s{};
  std::string model, material;  ///< of the sound; without a model the body has none
};

/// The bodies of one fall, as the file of docs/decisions/sound/0042 has them.
struct FallScene {
  Vector gravity_m_per_s2{0, 0, -9.81};
  double friction = 0.5, restitution = 0;  ///< of every pair of bodies
  double roughness_depth = 0, irregularity_length_m = 0.001;
  double seconds = 2;  ///< the simulated time, unless the user wants another
  std::vector<Body> bodies;
};

/// Reads a scene. Errors: InvalidArgument, whose message names the field that is missing.
absl::StatusOr<FallScene> ReadFallScene(const std::string& path);

}  // namespace carillon::falls
