// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace carillon::motion {

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;
using Turn = Eigen::Quaterniond;

/// The place of a body's frame in the scene.
struct BodyPose {
  Vector position_m = Vector::Zero();
  Turn orientation = Turn::Identity();
};

/// A closed surface in the frame of its body, metres, whose triangles turn their outsides by the
/// right hand.
struct BodySurface {
  std::vector<Vector> vertices_m;
  std::vector<std::array<uint32_t, 3>> triangles;
};

/// A body and its motion.
struct MovingBody {
  std::string name;
  BodySurface surface;
  /// What the simulator collides in its place, if that is another one, and the radius by which the
  /// simulator rounds it: contacts lie on a surface this much farther out.
  BodySurface collider;
  double rounding_m = 0;
  /// Zero: nothing is known of what moves the body, or it is fixed. Its momentum is not balanced.
  double mass_kg = 0;
  Vector centre_of_mass_m = Vector::Zero();  ///< in the body's frame
  Matrix inertia_kg_m2 = Matrix::Zero();     ///< about the centre of mass, in the body's axes
  double friction = 0.6;                     ///< a pair has the geometric mean of both
  /// The share of its velocity and of its angular velocity that the simulator takes from a body in
  /// a second, whatever it touches.
  double linear_damping = 0, angular_damping = 0;
  std::vector<BodyPose> poses;  ///< one for each frame, or a single one: a fixed body

  const BodySurface& touching() const { return collider.triangles.empty() ? surface : collider; }
};

/// What a joint leaves free.
enum class JointKind { kBall, kHinge, kFixed };

/// A joint that holds two bodies together, or one body to the scene.
struct Joint {
  size_t body = 0;
  int other = -1;                    ///< the second body; -1: the scene
  Vector anchor_m = Vector::Zero();  ///< in the first body's frame
  Vector axis = Vector::UnitZ();     ///< a hinge turns about it, in the first body's frame
  JointKind kind = JointKind::kBall;
};

/// Bodies whose poses are known at frames of equal distance in time.
struct Motion {
  double first_time_s = 0;
  double frame_s = 1.0 / 60;
  bool frames_are_steps = false;  ///< of a simulator, whose impulses act at the frames alone
  Vector gravity_m_per_s2{0, 0, -9.81};
  std::vector<MovingBody> bodies;
  std::vector<Joint> joints;

  size_t frame_count() const {
    size_t count = 0;
    for (const MovingBody& body : bodies) count = std::max(count, body.poses.size());
    return count;
  }
};

/// Returns the frame at or before a time since the first frame, s, and the time since that frame.
inline std::pair<size_t, double> FrameAt(double time_s, double frame_s, size_t frame_count) {
  const double frames = time_s / frame_s;
  const size_t frame = std::min(static_cast<size_t>(frames + 1e-9), frame_count - 2);
  return {frame, std::max(0.0, time_s - static_cast<double>(frame) * frame_s)};
}

/// A point of a contact between two bodies. Vectors act on body `a`, and their opposites on `b`.
struct ContactPoint {
  uint32_t a = 0, b = 0;
  size_t frame = 0;                   ///< the frame at or before the contact
  Vector point_a_m = Vector::Zero();  ///< in a's frame, on a's surface
  Vector point_b_m = Vector::Zero();  ///< in b's frame, on b's surface
};

/// A blow.
struct FoundBlow : ContactPoint {
  /// The time since the first frame, s.
  double SinceFirst(double frame_s) const { return static_cast<double>(frame) * frame_s + time_s; }

  double time_s = 0;                               ///< since frame `frame`
  Vector impulse_newton_seconds = Vector::Zero();  ///< in the scene's axes
  Vector normal = Vector::Zero();                  ///< towards a, in the scene's axes
  Turn orientation_a = Turn::Identity();           ///< how a lies at the time of the blow
  Turn orientation_b = Turn::Identity();
  /// Speed at which the bodies approach each other there before, m/s; 0 if it is not known.
  double approach_m_per_s = 0;
  /// Share of the impulse that other solutions, which explain the motion as well, do not have.
  double ambiguity = 0;
  /// The time since the first frame and the impulse that balance the momenta. Above, corners that
  /// cannot be told apart have one time, and even impulses.
  double balanced_s = 0;
  Vector balanced_newton_seconds = Vector::Zero();
};

/// The force of a contact that rests, slides or rolls, at the time of its frame. It is
/// interpolated linearly from frame to frame.
struct FoundLoad : ContactPoint {
  Vector force_newtons = Vector::Zero();  ///< in the scene's axes
  double slip_m_per_s = 0;                ///< speed at which the surfaces slide over each other
};

/// How well the contacts explain the motion.
struct Confidence {
  /// |A x - b|^2 / |b|^2 of momenta scaled to energy: 0 where the contacts found explain all.
  double unexplained = 0;
  std::vector<double> unexplained_of_body;
  /// Share of the impulse of all blows that differs between solutions that explain the motion
  /// equally well.
  double ambiguity = 0;
  size_t worst_body = 0;  ///< whose momentum is least explained
  size_t worst_frame = 0;
  double nearest_gap_m = 0;   ///< from the worst body to any other at that frame
  double worst_radius_m = 0;  ///< how large the worst body is
  /// How deep one of two bodies that strike each other is inside of the other in some frame, as a
  /// part of the radius of the smaller one, and which bodies these are.
  double deepest_part = 0, deepest_m = 0;
  size_t deepest_a = 0, deepest_b = 0;
  /// How deep one of two bodies is inside of the other while it falls freely, as a part of half the
  /// least side of the thinner one, and which bodies these are.
  double sunk_part = 0, sunk_m = 0;
  size_t sunk_a = 0, sunk_b = 0;
  /// How far apart the bodies of the strongest blow are then, as a part of the radius of the
  /// smaller one.
  double apart_part = 0;
};

/// The contacts that explain a motion.
struct FoundContacts {
  std::vector<FoundBlow> blows;  ///< in order of time
  std::vector<FoundLoad> loads;  ///< in order of frames
  Confidence confidence;
};

}  // namespace carillon::motion
