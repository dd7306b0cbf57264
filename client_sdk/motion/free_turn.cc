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

namespace {

/// A momentum to shoot with, and the turn by which it misses.
struct Shot {
  Vector momentum = Vector::Zero();
  Vector missing = Vector::Zero();
};

/// Changes the momentum by a step of Newton's method, or by a part of it, so that less of the turn
/// is missing. A slender body needs it, whose moments differ by more than ten times. Returns
/// whether it could.
template <typename MissingWith, typename SimpleStep>
bool TakeNewtonStep(const MissingWith& missing_with, const SimpleStep& simple_step, Shot& shot) {
  constexpr double kAngle = 1e-5;  // rad, by which each column of the derivative is found
  Matrix moves, changes;
  for (int axis = 0; axis < 3; ++axis) {
    moves.col(axis) = simple_step(kAngle * Vector::Unit(axis));
    changes.col(axis) = missing_with(shot.momentum + moves.col(axis)) - shot.missing;
  }
  const Vector step = -moves * changes.fullPivLu().solve(shot.missing);
  if (!step.allFinite()) return false;
  for (double part = 1; part > 1e-3; part /= 2) {
    const Vector after = missing_with(shot.momentum + part * step);
    if (after.norm() >= shot.missing.norm()) continue;
    shot.momentum += part * step;
    shot.missing = after;
    return true;
  }
  return false;
}

/// Improves a shot until it hits, or until no step does.
void Shoot(const Inertia& inertia, const Turn& from, const Turn& to, double time_s,
           const std::vector<TorqueImpulse>& impulses, Shot& shot) {
  constexpr int kMostSteps = 40;
  constexpr double kSmall = 1e-11;  // rad
  const auto missing_with = [&](Vector momentum) {
    return RotationVector(to * TurnThrough(inertia, from, time_s, impulses, momentum).conjugate());
  };
  // A step as if the inertia in the middle of the way stayed: for most bodies the rest of it
  // shrinks fast.
  const Turn middle = from.slerp(0.5, to);
  const auto simple_step = [&](const Vector& missing) {
    return Vector(middle * (inertia.tensor_kg_m2 * (middle.conjugate() * missing)) / time_s);
  };
  shot.missing = missing_with(shot.momentum);
  for (int i = 0; i < kMostSteps && shot.missing.norm() > kSmall; ++i) {
    const Vector simple = shot.momentum + simple_step(shot.missing);
    const Vector after = missing_with(simple);
    if (after.norm() < 0.5 * shot.missing.norm()) {
      shot = {.momentum = simple, .missing = after};
    } else if (!TakeNewtonStep(missing_with, simple_step, shot)) {
      return;
    }
  }
}

}  // namespace

Vector ShootMomentum(const Inertia& inertia, const Turn& from, const Turn& to, double time_s,
                     const std::vector<TorqueImpulse>& impulses, const Vector& guess) {
  constexpr double kNear = 1e-8;  // rad
  constexpr double kSlender = 10, kFaster = 1.5;
  constexpr int kBodyCount = 16;
  Shot best{.momentum = guess};
  Shoot(inertia, from, to, time_s, impulses, best);
  const Vector moments = Eigen::SelfAdjointEigenSolver<Matrix>(inertia.tensor_kg_m2).eigenvalues();
  if (best.missing.norm() < kNear && moments[2] < kSlender * moments[0]) return best.momentum;
  // A slender body may spin by whole turns about its axis between two frames. The turn without
  // them is approached from a body with equal moments, for which it is plain.
  const Matrix plain = Matrix::Identity() * moments.mean();
  Shot shot{.momentum = plain * RotationVector(to * from.conjugate()) / time_s};
  for (int i = 0; i <= kBodyCount; ++i) {
    const double part = static_cast<double>(i) / kBodyCount;
    Shoot(Inertia((1 - part) * plain + part * inertia.tensor_kg_m2), from, to, time_s, impulses,
          shot);
  }
  const auto speed = [&](const Shot& one) {
    return AngularVelocity(inertia, from, one.momentum).norm();
  };
  const bool is_better = best.missing.norm() < kNear
                             ? shot.missing.norm() < kNear && kFaster * speed(shot) < speed(best)
                             : shot.missing.norm() < best.missing.norm();
  return is_better ? shot.momentum : best.momentum;
}

}  // namespace carillon::motion
