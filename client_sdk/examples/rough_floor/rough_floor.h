// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "carillon/v1/contact.pb.h"

namespace carillon::rough_floor {

/// The motion on the floor.
enum class Scene {
  kRest,  ///< a box falls from 5 cm and comes to rest
  kDrag,  ///< the same box is dragged at 0.5 m/s between the second and the fourth second
  kRoll,  ///< a tilted bowl rolls on its outside
};

inline constexpr double kDropHeight_m = 0.05;
inline constexpr double kDragStart_s = 2, kDragEnd_s = 4, kDragSpeed_m_per_s = 0.5;
inline constexpr double kTilt_rad = 1.1, kRollSpin_rad_per_s = 9;

/// The body on the floor. The origin of its frame is its centre of mass.
struct Body {
  std::array<double, 3> box_m{0.20, 0.14, 0.03};  ///< sides
  /// The bowl is half a thin sphere that opens along +z. The centre of the sphere is half a radius
  /// above the origin. The moments of inertia are 2/3 m R^2 about z and 5/12 m R^2 about x and y.
  double bowl_radius_m = 0.08;
  double mass_kg = 2;
};

/// Advances a simulation by one step and returns its contacts. The body is the object 1.
using Simulation = std::function<v1::ContactStep()>;

/// Simulates the scene in Bullet or in ODE with steps of `step_s` seconds.
Simulation SimulateInBullet(Scene scene, const Body& body, double step_s);
Simulation SimulateInOde(Scene scene, const Body& body, double step_s);

}  // namespace carillon::rough_floor
