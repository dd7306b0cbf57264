// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/free_turn.h"

#include <algorithm>
#include <cmath>

namespace carillon::motion {
namespace {

/// The largest angle of one step of integration, rad: the error of a step is below 1e-8 rad.
constexpr double kStepAngle = 0.1;

Vector AngularVelocity(const Inertia& inertia, const Turn& at, const Vector& momentum) {
  return at * (inertia.inverse * (at.conjugate() * momentum));
}

Turn Slope(const Inertia& inertia, const Turn& at, const Vector& momentum) {
  const Vector half = AngularVelocity(inertia, at.normalized(), momentum) / 2;
  return Turn(0, half.x(), half.y(), half.z()) * at;
}

Turn Plus(const Turn& a, const Turn& b, double scale) {
  return Turn(Eigen::Vector4d(a.coeffs() + scale * b.coeffs()));
}

Turn About(const Vector& rotation) {
  const double angle = rotation.norm();
  if (angle < 1e-300) return Turn::Identity();
  return Turn(Eigen::AngleAxisd(angle, rotation / angle));
}

}  // namespace

Inertia::Inertia(const Matrix& tensor)
    : tensor_kg_m2(tensor),
      inverse(tensor.inverse()),
      isotropic((tensor - Matrix::Identity() * tensor.trace() / 3).norm() < 1e-9 * tensor.norm()) {}

Vector RotationVector(const Turn& turn) {
  const double sign = turn.w() < 0 ? -1 : 1;
  const double sine = turn.vec().norm();
  if (sine < 1e-12) return 2 * sign * turn.vec();
  return 2 * sign * std::atan2(sine, std::abs(turn.w())) / sine * turn.vec();
}

Turn TurnFreely(const Inertia& inertia, const Turn& from, const Vector& momentum, double time_s) {
  const Vector angular = AngularVelocity(inertia, from, momentum);
  if (inertia.isotropic) return About(angular * time_s) * from;
  // The momentum bounds the speed at any time: it is divided by the least moment at most.
  const double angle = angular.norm() * std::abs(time_s);
  const int steps = std::max(1, static_cast<int>(std::ceil(1.5 * angle / kStepAngle)));
  const double h = time_s / steps;
  Turn at = from;
  for (int i = 0; i < steps; ++i) {
    const Turn k1 = Slope(inertia, at, momentum);
    const Turn k2 = Slope(inertia, Plus(at, k1, h / 2), momentum);
    const Turn k3 = Slope(inertia, Plus(at, k2, h / 2), momentum);
    const Turn k4 = Slope(inertia, Plus(at, k3, h), momentum);
    at = Turn(Eigen::Vector4d(at.coeffs() +
                              h / 6 *
                                  (k1.coeffs() + 2 * k2.coeffs() + 2 * k3.coeffs() + k4.coeffs())))
             .normalized();
  }
  return at;
}

Turn TurnThrough(const Inertia& inertia, const Turn& from, double time_s,
                 const std::vector<TorqueImpulse>& impulses, Vector& momentum) {
  Turn at = from;
  double now = 0;
  for (const TorqueImpulse& impulse : impulses) {
    if (impulse.time_s > time_s) break;
    at = TurnFreely(inertia, at, momentum, impulse.time_s - now);
    momentum += impulse.change;
    now = impulse.time_s;
  }
  return TurnFreely(inertia, at, momentum, time_s - now);
}

Vector ShootMomentum(const Inertia& inertia, const Turn& from, const Turn& to, double time_s,
                     const std::vector<TorqueImpulse>& impulses, const Vector& guess) {
  constexpr int kMostSteps = 40;
  constexpr double kSmall = 1e-11;  // rad
  Vector momentum = guess, best = guess;
  double least = 1e300;
  for (int i = 0; i < kMostSteps; ++i) {
    Vector end = momentum;
    const Turn reached = TurnThrough(inertia, from, time_s, impulses, end);
    const Vector missing = RotationVector(to * reached.conjugate());
    const double size = missing.norm();
    if (size < least) {
      least = size;
      best = momentum;
    }
    if (size < kSmall) break;
    // A step as if the inertia in the middle of the way stayed: the rest of it shrinks fast.
    const Turn middle = from.slerp(0.5, to);
    momentum = best + (size > least ? 0.5 : 1.0) *
                          (middle * (inertia.tensor_kg_m2 * (middle.conjugate() * missing))) /
                          time_s;
  }
  return best;
}

}  // namespace carillon::motion
