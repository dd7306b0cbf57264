// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace carillon::motion {
namespace {

/// Returns the rotation vector that turns as `turn` does, and is nearest to `like`: a body may turn
/// more than half around between two frames.
Vector NearestTurn(const Vector& turn, const Vector& like) {
  const double angle = turn.norm();
  if (angle < 1e-6) return turn;
  const Vector axis = turn / angle;
  const double turns = std::round((axis.dot(like) - angle) / (2 * std::numbers::pi));
  return turn + 2 * std::numbers::pi * turns * axis;
}

}  // namespace

BodyMotion::BodyMotion(const MovingBody& body, const Motion& motion)
    : mass_kg_(body.poses.size() > 1 ? body.mass_kg : 0),
      frame_s_(motion.frame_s),
      kept_(std::pow(1 - body.linear_damping, motion.frame_s)),
      kept_turn_(std::pow(1 - body.angular_damping, motion.frame_s)),
      gravity_(motion.gravity_m_per_s2),
      centre_m_(body.centre_of_mass_m),
      inertia_(body.mass_kg > 0 ? body.inertia_kg_m2 : Matrix(Matrix::Identity())) {
  for (const Vector& vertex : body.touching().vertices_m) {
    radius_m_ = std::max(radius_m_, (vertex - centre_m_).norm());
  }
  radius_m_ += body.rounding_m;
  for (const BodyPose& pose : body.poses) {
    const Turn turn = pose.orientation.normalized();
    places_.push_back({pose.position_m + turn * centre_m_, turn});
  }
  if (!moves()) return;
  const size_t intervals = places_.size() - 1;
  for (size_t k = 0; k < intervals; ++k) {
    const Vector turn =
        RotationVector(places_[k + 1].orientation * places_[k].orientation.conjugate());
    turn_.push_back(NearestTurn(turn, k > 0 ? turn_.back() : Vector(turn)));
  }
  impulses_.resize(intervals);
  if (!balanced()) return;
  forces_.assign(places_.size(), Vector::Zero());
  start_.resize(intervals);
  end_.resize(intervals);
  for (size_t k = 0; k < intervals; ++k) Shoot(k);
}

Vector BodyMotion::Guess(size_t interval) const {
  const Turn middle = places_[interval].orientation.slerp(0.5, places_[interval + 1].orientation);
  return middle * (inertia_.tensor_kg_m2 * (middle.conjugate() * turn_[interval])) / frame_s_;
}

std::vector<TorqueImpulse> BodyMotion::TorquesOf(size_t interval) const {
  std::vector<TorqueImpulse> torques;
  for (const BodyImpulse& impulse : impulses_[interval]) {
    torques.push_back({impulse.time_s, impulse.torque});
  }
  return torques;
}

void BodyMotion::Shoot(size_t interval) {
  const std::vector<TorqueImpulse> torques = TorquesOf(interval);
  Vector guess = Guess(interval);
  for (const TorqueImpulse& torque : torques) {
    guess -= (1 - torque.time_s / frame_s_) * torque.change;
  }
  start_[interval] = end_[interval] =
      ShootMomentum(inertia_, places_[interval].orientation, places_[interval + 1].orientation,
                    frame_s_, torques, guess);
  for (const TorqueImpulse& torque : torques) end_[interval] += torque.change;
}

void BodyMotion::Know(const std::vector<std::vector<BodyImpulse>>& impulses,
                      std::vector<Vector> forces) {
  forces_ = std::move(forces);
  for (size_t k = 0; k < impulses_.size(); ++k) {
    if (!impulses_[k].empty() || !impulses[k].empty()) Know(k, impulses[k]);
  }
}

void BodyMotion::Know(size_t interval, std::vector<BodyImpulse> impulses) {
  impulses_[interval] = std::move(impulses);
  std::ranges::stable_sort(impulses_[interval], {}, &BodyImpulse::time_s);
  Shoot(interval);
}

Vector BodyMotion::Impulse(size_t node) const {
  const Vector jump = places_[node + 1].position_m - 2 * places_[node].position_m +
                      places_[node - 1].position_m +
                      (1 - kept_) * (places_[node].position_m - places_[node - 1].position_m);
  return mass_kg_ * (jump / frame_s_ - gravity_ * frame_s_);
}

Vector BodyMotion::Torque(size_t node) const {
  Vector torque = start_[node] - kept_turn_ * end_[node - 1];
  for (const BodyImpulse& impulse : impulses_[node]) {
    torque += (1 - impulse.time_s / frame_s_) * impulse.torque;
  }
  for (const BodyImpulse& impulse : impulses_[node - 1]) {
    torque += impulse.time_s / frame_s_ * impulse.torque;
  }
  return torque;
}

Matrix BodyMotion::InverseInertia(size_t frame) const {
  const Matrix turn = places_[frame].orientation.toRotationMatrix();
  return turn * inertia_.inverse * turn.transpose();
}

BodyPose BodyMotion::AtFrame(size_t frame) const { return places_[moves() ? frame : 0]; }

BodyPose BodyMotion::At(size_t interval, double time_s, Path path) const {
  if (!moves()) return places_[0];
  const BodyPose &from = places_[interval], &to = places_[interval + 1];
  const double h = frame_s_, share = time_s / h;
  if (!balanced() || path == Path::kBetween) {
    return {
        from.position_m + share * (to.position_m - from.position_m),
        Turn(Eigen::AngleAxisd(share * turn_[interval].norm(),
                               turn_[interval].norm() > 1e-12 ? Vector(turn_[interval].normalized())
                                                              : Vector(Vector::UnitX()))) *
            from.orientation};
  }
  if (path == Path::kBefore && interval > 0) {
    const Vector velocity =
        (from.position_m - places_[interval - 1].position_m) / h + gravity_ * h / 2;
    return {from.position_m + velocity * time_s + gravity_ * time_s * time_s / 2,
            TurnFreely(inertia_, from.orientation, end_[interval - 1], time_s)};
  }
  if (path == Path::kAfter && interval + 2 < places_.size()) {
    const double back = time_s - h;
    const Vector velocity =
        (places_[interval + 2].position_m - to.position_m) / h - gravity_ * h / 2;
    return {to.position_m + velocity * back + gravity_ * back * back / 2,
            TurnFreely(inertia_, to.orientation, start_[interval + 1], back)};
  }
  return Known(interval, time_s);
}

Vector BodyMotion::Acceleration(size_t frame) const { return gravity_ + forces_[frame] / mass_kg_; }

Vector BodyMotion::StartVelocity(size_t interval) const {
  const double h = frame_s_;
  Vector velocity = (places_[interval + 1].position_m - places_[interval].position_m) / h -
                    h * (Acceleration(interval) / 3 + Acceleration(interval + 1) / 6);
  for (const BodyImpulse& impulse : impulses_[interval]) {
    velocity -= (1 - impulse.time_s / h) * impulse.impulse / mass_kg_;
  }
  return velocity;
}

BodyPose BodyMotion::Known(size_t interval, double time_s) const {
  const double h = frame_s_;
  const Vector a0 = Acceleration(interval), a1 = Acceleration(interval + 1);
  Vector bent = Vector::Zero();
  for (const BodyImpulse& impulse : impulses_[interval]) {
    bent += std::max(0.0, time_s - impulse.time_s) * impulse.impulse / mass_kg_;
  }
  Vector momentum = start_[interval];
  const Turn turn =
      TurnThrough(inertia_, places_[interval].orientation, time_s, TorquesOf(interval), momentum);
  return {places_[interval].position_m + StartVelocity(interval) * time_s + bent +
              a0 * time_s * time_s / 2 + (a1 - a0) * time_s * time_s * time_s / (6 * h),
          turn};
}

double BodyMotion::Speed(size_t interval) const {
  if (!moves()) return 0;
  return ((places_[interval + 1].position_m - places_[interval].position_m).norm() +
          radius_m_ * turn_[interval].norm()) /
         frame_s_;
}

Vector BodyMotion::MeanVelocity(size_t interval, const Vector& arm) const {
  if (!moves()) return Vector::Zero();
  return (places_[interval + 1].position_m - places_[interval].position_m +
          turn_[interval].cross(arm)) /
         frame_s_;
}

Vector BodyMotion::VelocityAt(size_t frame, const Vector& arm) const {
  if (!moves()) return Vector::Zero();
  const size_t before = frame > 0 ? frame - 1 : frame;
  const size_t after = std::min(frame, turn_.size() - 1);
  return (MeanVelocity(before, arm) + MeanVelocity(after, arm)) / 2;
}

Vector BodyMotion::KnownVelocity(size_t interval, double time_s, const Vector& arm) const {
  if (!balanced()) return VelocityAt(interval, arm);
  const Vector a0 = Acceleration(interval), a1 = Acceleration(interval + 1);
  Vector velocity =
      StartVelocity(interval) + a0 * time_s + (a1 - a0) * time_s * time_s / (2 * frame_s_);
  for (const BodyImpulse& impulse : impulses_[interval]) {
    if (impulse.time_s <= time_s) velocity += impulse.impulse / mass_kg_;
  }
  Vector momentum = start_[interval];
  const Turn turn =
      TurnThrough(inertia_, places_[interval].orientation, time_s, TorquesOf(interval), momentum);
  return velocity + (turn * (inertia_.inverse * (turn.conjugate() * momentum))).cross(arm);
}

double BodyMotion::Jump(size_t node) const {
  return Impulse(node).norm() / mass_kg_ + radius_m_ * (InverseInertia(node) * Torque(node)).norm();
}

}  // namespace carillon::motion
