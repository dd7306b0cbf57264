// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "client_sdk/motion/free_turn.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// From which frame the place of a body between two frames is computed.
enum class Path {
  kBefore,   ///< free flight with the momenta that the body had before the first frame
  kBetween,  ///< straight from the first frame to the second
  kAfter,    ///< free flight, backwards, with the momenta after the second frame
  kKnown     ///< with the impulses and forces found so far
};

/// An impulse on a body within an interval of two frames.
struct BodyImpulse {
  double time_s = 0;  ///< since the interval's first frame
  Vector impulse = Vector::Zero();
  Vector torque = Vector::Zero();  ///< about the centre of mass
};

/// The balance of one body. Node k is frame k, interval k lies between the frames k and k + 1.
///
/// With the hat function phi_k, which is 1 at frame k and 0 at its neighbours, any force F
/// satisfies
///
///     P_k = int phi_k F dt = m (V_k - V_{k-1} - g h),   V_k = (x_{k+1} - x_k) / h
///
/// exactly. An impulse J at the share theta of interval k gives P_k (1 - theta) J, and P_{k+1}
/// theta J. Angular momentum has the same balance with the momentum of the torque-free turn between
/// two frames; what the impulses of an interval add beyond first order is moved to the right side.
/// Where a simulator damps velocities, V_{k-1} and its angular momentum are those that it leaves.
class BodyMotion {
 public:
  BodyMotion(const MovingBody& body, const Motion& motion);

  bool balanced() const { return mass_kg_ > 0; }
  double mass_kg() const { return mass_kg_; }
  double radius_m() const { return radius_m_; }
  const Vector& centre_m() const { return centre_m_; }

  /// Linear and angular momentum that contacts gave at a node, N s and N m s; 0 < node < frames
  /// - 1.
  Vector Impulse(size_t node) const;
  Vector Torque(size_t node) const;
  /// I^-1 in the scene's axes at a frame.
  Matrix InverseInertia(size_t frame) const;

  /// The place of the centre of mass and the orientation at a time within an interval.
  BodyPose At(size_t interval, double time_s, Path path) const;
  BodyPose AtFrame(size_t frame) const;
  /// The greatest speed of any point, m/s, on average over an interval.
  double Speed(size_t interval) const;
  /// The turn within an interval, rad.
  double Angle(size_t interval) const { return turn_[interval].norm(); }
  /// The velocity of a point `arm` away from the centre of mass, averaged over an interval.
  Vector MeanVelocity(size_t interval, const Vector& arm) const;
  /// The velocity of a point `arm` away from the centre of mass, averaged around a frame.
  Vector VelocityAt(size_t frame, const Vector& arm) const;
  /// The velocity of a point `arm` away from the centre of mass at a time within an interval, on
  /// the path that the known impulses and forces give.
  Vector KnownVelocity(size_t interval, double time_s, const Vector& arm) const;
  /// The greatest change of the velocity of any point at a node beyond free flight, m/s.
  double Jump(size_t node) const;

  /// Takes the impulses and the forces (one for each frame) that were found, after which Torque()
  /// and Path::kKnown follow from them.
  void Know(const std::vector<std::vector<BodyImpulse>>& impulses, std::vector<Vector> forces);
  /// Takes other impulses in one interval.
  void Know(size_t interval, std::vector<BodyImpulse> impulses);
  const std::vector<BodyImpulse>& known_impulses(size_t interval) const {
    return impulses_[interval];
  }

 private:
  bool moves() const { return places_.size() > 1; }
  BodyPose Known(size_t interval, double time_s) const;
  Vector Acceleration(size_t frame) const;
  /// The velocity of the centre at the beginning of an interval.
  Vector StartVelocity(size_t interval) const;
  std::vector<TorqueImpulse> TorquesOf(size_t interval) const;
  Vector Guess(size_t interval) const;
  void Shoot(size_t interval);

  double mass_kg_, frame_s_, radius_m_ = 0;
  double kept_ = 1, kept_turn_ = 1;  ///< of the velocities of a frame, in the next one
  Vector gravity_, centre_m_;
  Inertia inertia_;
  std::vector<BodyPose> places_;  ///< where the centre of mass is at each frame
  std::vector<Vector> turn_;      ///< rotation vector of each interval
  /// Angular momentum at the beginning and at the end of each interval.
  std::vector<Vector> start_, end_;
  std::vector<std::vector<BodyImpulse>> impulses_;
  std::vector<Vector> forces_;
};

}  // namespace carillon::motion
