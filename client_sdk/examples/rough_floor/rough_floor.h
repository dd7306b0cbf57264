// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>

#include "carillon/v1/contact.pb.h"

namespace carillon::rough_floor {

/// What happens on the floor.
enum class Scene {
  kRest,  ///< a box falls from 5 cm and lies there
  kDrag,  ///< the same, and after two seconds it is dragged along at 0.5 m/s for two
  kRoll,  ///< a bowl, tilted, rolls about on its outside
};

inline constexpr double kDropHeight_m = 0.05;
inline constexpr double kDragStart_s = 2, kDragEnd_s = 4, kDragSpeed_m_per_s = 0.5;
inline constexpr double kTilt_rad = 1.1, kRollSpin_rad_per_s = 9;

/// What lies on the floor; its frame's origin is its centre of mass.
struct Body {
  std::array<double, 3> box_m{0.20, 0.14, 0.03};  ///< sides
  /// Of the bowl, half a thin sphere that opens along +z: the middle of the sphere is at half its
  /// radius above the origin, m R^2 (2/3 about z, 5/12 across) its moments of inertia.
  double bowl_radius_m = 0.08;
  double mass_kg = 2;
};

/// One step of a simulation, of which object 1 is the body.
using Simulation = std::function<v1::ContactStep()>;

/// The scene in Bullet, and in ODE, with steps of `step_s`.
Simulation SimulateInBullet(Scene scene, const Body& body, double step_s);
Simulation SimulateInOde(Scene scene, const Body& body, double step_s);

}  // namespace carillon::rough_floor
