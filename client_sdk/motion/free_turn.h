// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// Inertia of a body about its centre of mass, in the body's axes.
struct Inertia {
  explicit Inertia(const Matrix& tensor_kg_m2);

  Matrix tensor_kg_m2;
  Matrix inverse;
  bool isotropic = false;
};

/// Returns the rotation vector (axis times angle, rad, at most pi long) of a turn.
Vector RotationVector(const Turn& turn);

/// Turns a body on which no torque acts for `time_s`, which may be negative. `momentum` is its
/// angular momentum in the scene's axes, kg m^2/s, which stays constant. Integrates
/// R' = [R I^-1 R^T L] R by the classic method of Runge and Kutta.
Turn TurnFreely(const Inertia& inertia, const Turn& from, const Vector& momentum, double time_s);

/// An instantaneous change of angular momentum.
struct TorqueImpulse {
  double time_s = 0;
  Vector change = Vector::Zero();  ///< N m s, in the scene's axes
};

/// Finds by shooting the angular momentum at the beginning with which a body turns from one
/// orientation to another within `time_s`, while impulses act on it in order of time. `guess` is a
/// momentum that chooses among whole turns.
Vector ShootMomentum(const Inertia& inertia, const Turn& from, const Turn& to, double time_s,
                     const std::vector<TorqueImpulse>& impulses, const Vector& guess);

/// Returns the orientation after `time_s`, with the impulses until then. `momentum` becomes the one
/// at that time.
Turn TurnThrough(const Inertia& inertia, const Turn& from, double time_s,
                 const std::vector<TorqueImpulse>& impulses, Vector& momentum);

}  // namespace carillon::motion
