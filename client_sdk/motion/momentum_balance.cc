// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/momentum_balance.h"

#include <algorithm>
#include <cmath>

namespace carillon::motion {
namespace {

/// An unknown that does not change is left out of so many sweeps.
constexpr int kRest = 7;

Matrix Cross(const Vector& v) {
  Matrix m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Returns the nearest point of the cone |tangent| <= friction * normal component.
Vector Project(const Vector& f, const Vector& normal, double friction) {
  const double along = f.dot(normal);
  const Vector tangent = f - along * normal;
  const double size = tangent.norm();
  if (size <= friction * along) return f;
  if (friction * size <= -along) return Vector::Zero();
  const double best = (along + friction * size) / (1 + friction * friction);
  return best * normal + (size > 0 ? friction * best / size : 0) * tangent;
}

}  // namespace

MomentumBalance::MomentumBalance(size_t body_count, size_t frame_count)
    : frames_(frame_count), rows_(body_count * frame_count) {}

void MomentumBalance::AddNode(size_t body, size_t frame, double mass_kg,
                              const Matrix& inverse_inertia, const Vector& impulse,
                              const Vector& torque) {
  Row& r = row(static_cast<int>(body), frame);
  r.inverse_mass = 1 / mass_kg;
  r.inverse_inertia = inverse_inertia;
  r.impulse = impulse;
  r.torque = torque;
  r.velocity = impulse / mass_kg;
  r.angular = inverse_inertia * torque;
  r.given = impulse.dot(r.velocity) + torque.dot(r.angular);
}

size_t MomentumBalance::Add(const Unknown& unknown) {
  unknowns_.push_back(unknown);
  values_.emplace_back(Vector::Zero());
  allowed_.push_back(true);
  return unknowns_.size() - 1;
}

Vector MomentumBalance::Gradient(const Unknown& u) const {
  Vector gradient = Vector::Zero();
  for (int i = 0; i < u.node_count; ++i) {
    const auto& [frame, weight] = u.nodes[static_cast<size_t>(i)];
    Vector relative = Vector::Zero();
    if (u.kind == UnknownKind::kJointTorque) {
      if (u.a >= 0) relative += row(u.a, frame).angular;
      if (u.b >= 0) relative -= row(u.b, frame).angular;
    } else {
      if (u.a >= 0) relative += row(u.a, frame).velocity + row(u.a, frame).angular.cross(u.arm_a);
      if (u.b >= 0) relative -= row(u.b, frame).velocity + row(u.b, frame).angular.cross(u.arm_b);
    }
    gradient += weight * relative;
  }
  return gradient;
}

void MomentumBalance::Change(const Unknown& u, const Vector& change) {
  for (int i = 0; i < u.node_count; ++i) {
    const auto& [frame, weight] = u.nodes[static_cast<size_t>(i)];
    for (const int side : {1, -1}) {
      const int body = side > 0 ? u.a : u.b;
      if (body < 0) continue;
      Row& r = row(body, frame);
      if (r.inverse_mass == 0) continue;
      const Vector f = side * weight * change;
      const Vector torque =
          u.kind == UnknownKind::kJointTorque ? f : Vector((side > 0 ? u.arm_a : u.arm_b).cross(f));
      r.torque -= torque;
      r.angular -= r.inverse_inertia * torque;
      if (u.kind == UnknownKind::kJointTorque) continue;
      r.impulse -= f;
      r.velocity -= r.inverse_mass * f;
    }
  }
}

MomentumBalance::Active MomentumBalance::MakeActive(size_t index) const {
  const Unknown& u = unknowns_[index];
  Active active{.unknown = index};
  for (int i = 0; i < u.node_count; ++i) {
    const auto& [frame, weight] = u.nodes[static_cast<size_t>(i)];
    for (const bool first : {true, false}) {
      const int body = first ? u.a : u.b;
      if (body < 0) continue;
      const Row& r = row(body, frame);
      if (u.kind == UnknownKind::kJointTorque) {
        active.hessian += weight * weight * r.inverse_inertia;
        continue;
      }
      const Matrix arm = Cross(first ? u.arm_a : u.arm_b);
      active.hessian +=
          weight * weight *
          (r.inverse_mass * Matrix::Identity() + arm * r.inverse_inertia * arm.transpose());
    }
  }
  active.largest = active.hessian.trace();
  Matrix solved = active.hessian + 1e-9 * active.largest * Matrix::Identity();
  if (u.kind == UnknownKind::kJointTorque) {
    solved += 1e6 * active.largest * u.normal * u.normal.transpose();
  }
  active.inverse = active.largest > 0 ? Matrix(solved.inverse()) : Matrix(Matrix::Zero());
  return active;
}

bool MomentumBalance::Wants(size_t i, double cost_factor, double least) const {
  const Unknown& u = unknowns_[i];
  if (!allowed_[i]) return false;
  if (u.kind != UnknownKind::kContact || !values_[i].isZero(0)) return true;
  const Vector pull = Gradient(u);
  const double along = pull.dot(u.normal);
  const double across = std::sqrt(std::max(0.0, pull.squaredNorm() - along * along));
  return along + u.friction * across > cost_factor * u.cost + least;
}

/// Returns the f of the cone that minimizes 1/2 f' H f - pull' f + cost * normal component.
Vector MomentumBalance::Best(const Active& active, const Vector& pull, double cost) const {
  constexpr int kSteps = 3;
  const Unknown& u = unknowns_[active.unknown];
  if (u.kind != UnknownKind::kContact) return active.inverse * pull;
  const Vector drive = pull - cost * u.normal;
  Vector f = active.inverse * drive;
  if (Project(f, u.normal, u.friction) == f) return f;
  f = values_[active.unknown];
  for (int i = 0; i < kSteps; ++i) {
    f = Project(f + (drive - active.hessian * f) / active.largest, u.normal, u.friction);
  }
  return f;
}

double MomentumBalance::Sweep(std::vector<Active>& active, double cost_factor, double least,
                              bool backwards) {
  double largest = 0;
  for (size_t n = 0; n < active.size(); ++n) {
    Active& one = active[backwards ? active.size() - 1 - n : n];
    if (one.largest == 0 || --one.rests > 0) continue;
    const Unknown& u = unknowns_[one.unknown];
    Vector& value = values_[one.unknown];
    const Vector pull = Gradient(u) + one.hessian * value;
    const Vector best = Best(one, pull, cost_factor * u.cost);
    const Vector change = best - value;
    const double speed = (one.hessian * change).norm();
    if (speed < least) one.rests = kRest;
    if (speed == 0) continue;
    value = best;
    Change(u, change);
    largest = std::max(largest, speed);
  }
  return largest;
}

void MomentumBalance::Solve(double cost_factor, double least) {
  constexpr int kMostRounds = 12, kMostSweeps = 150;
  std::vector<bool> is_active(unknowns_.size(), false);
  std::vector<Active> active;
  for (int round = 0; round < kMostRounds; ++round) {
    const size_t before = active.size();
    for (size_t i = 0; i < unknowns_.size(); ++i) {
      if (is_active[i] || !Wants(i, cost_factor, least)) continue;
      is_active[i] = true;
      active.push_back(MakeActive(i));
    }
    if (round > 0 && active.size() == before) break;
    int quiet = 0;
    for (int sweep = 0; sweep < kMostSweeps && quiet <= kRest; ++sweep) {
      quiet = Sweep(active, cost_factor, least, sweep % 2 == 1) < least ? quiet + 1 : 0;
    }
    std::erase_if(active, [&](const Active& one) {
      const bool idle = values_[one.unknown].isZero(0);
      if (idle) is_active[one.unknown] = false;
      return idle;
    });
  }
}

void MomentumBalance::Set(size_t i, const Vector& value) {
  Change(unknowns_[i], value - values_[i]);
  values_[i] = value;
}

void MomentumBalance::Allow(size_t i, bool allowed) {
  allowed_[i] = allowed;
  if (!allowed && !values_[i].isZero(0)) Set(i, Vector::Zero());
}

void MomentumBalance::AllowOnlyActive() {
  for (size_t i = 0; i < unknowns_.size(); ++i) {
    allowed_[i] = unknowns_[i].kind != UnknownKind::kContact || !values_[i].isZero(0);
  }
}

double MomentumBalance::Given(size_t body, size_t frame) const {
  return row(static_cast<int>(body), frame).given;
}

double MomentumBalance::Residual(size_t body, size_t frame) const {
  const Row& r = row(static_cast<int>(body), frame);
  return r.impulse.dot(r.velocity) + r.torque.dot(r.angular);
}

}  // namespace carillon::motion
