// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// What an unknown of the balance may be.
enum class UnknownKind {
  kContact,      ///< a force or an impulse in a cone of friction
  kJointForce,   ///< any force at a point
  kJointTorque,  ///< any torque across an axis, or any at all if the axis is zero
};

/// A force over some frames, or an impulse, between two bodies, with an effect on the nodes in its
/// support: row = weight * (f, arm x f) for body a, and the opposite for body b.
struct Unknown {
  struct Node {
    uint32_t frame = 0;
    double weight = 0;
  };
  UnknownKind kind = UnknownKind::kContact;
  int a = -1, b = -1;  ///< -1: not balanced
  Vector arm_a = Vector::Zero(), arm_b = Vector::Zero();
  Vector normal = Vector::Zero();  ///< from b to a; the axis of a joint's torque
  double friction = 0;
  double cost = 0;  ///< what 1 N s of the normal component costs, m/s
  std::array<Node, 5> nodes{};
  int node_count = 0;

  void Touch(size_t frame, double weight) {
    nodes[static_cast<size_t>(node_count++)] = {static_cast<uint32_t>(frame), weight};
  }
};

/// Finds the contacts that balance the momenta of all bodies at all nodes:
///
///     min 1/2 |A x - b|^2 + c' x    over x in the cones of friction,
///
/// where rows are scaled to energy: by m^(-1/2) and I^(-1/2). Blocks of three unknowns are solved
/// for in turn (block coordinate descent with conjugate directions), most of which never leave
/// zero. Islands of unknowns that share no node are solved apart, in parallel, and so are distant
/// times of an island.
class MomentumBalance {
 public:
  MomentumBalance(size_t body_count, size_t frame_count);

  /// Adds the balance of a body at a node to b.
  void AddNode(size_t body, size_t frame, double mass_kg, const Matrix& inverse_inertia,
               const Vector& impulse, const Vector& torque);
  /// Returns the index of the unknown.
  size_t Add(const Unknown& unknown);

  /// Solves with costs times `cost_factor`, from the values that the unknowns have. An unknown
  /// that would explain less than `least_m_per_s` of a velocity beyond its cost stays zero.
  void Solve(double cost_factor, double least_m_per_s);

  /// Unknowns that are not allowed are zero.
  void Allow(size_t i, bool allowed);
  void AllowOnlyActive();
  const Vector& value(size_t i) const { return values_[i]; }
  void Set(size_t i, const Vector& value);
  void ScaleCost(size_t i, double factor) { unknowns_[i].cost *= factor; }
  const Unknown& unknown(size_t i) const { return unknowns_[i]; }
  size_t size() const { return unknowns_.size(); }

  /// The energy of b, and that of A x - b, at a node, J. Both are zero where nothing was added.
  double Given(size_t body, size_t frame) const;
  double Residual(size_t body, size_t frame) const;

 private:
  struct Row {
    double inverse_mass = 0;  ///< zero: no such node
    Matrix inverse_inertia = Matrix::Zero();
    Vector velocity = Vector::Zero(),
           angular = Vector::Zero();  ///< what b - A x lacks, divided by m and I
    double given = 0;
  };
  struct Active {
    size_t unknown = 0;
    Matrix hessian = Matrix::Zero(), inverse = Matrix::Zero();
    double largest = 0;  ///< bound of the eigenvalues of the Hessian
    uint32_t island = 0, part = 0;
    int rests = 0;                      ///< sweeps that leave it out, because it hardly changed
    Vector step = Vector::Zero();       ///< what the last sweep changed
    Vector direction = Vector::Zero();  ///< what the sweeps before changed
  };
  /// Unknowns of some frames of an island, or those that last longer.
  struct Part {
    uint32_t number = 0;
    std::span<Active> unknowns;
    bool stale = true;  ///< not solved yet, or not since its neighbours have changed
    double gained = 0;  ///< by the last solution, J, twice
  };
  struct Island {
    size_t first = 0, count = 0;  ///< which of the active unknowns
    double energy = 0;            ///< what b has at its nodes, J
  };
  Row& row(int body, size_t frame) { return rows_[static_cast<size_t>(body) * frames_ + frame]; }
  const Row& row(int body, size_t frame) const {
    return rows_[static_cast<size_t>(body) * frames_ + frame];
  }
  Vector Missing(const Unknown& u, int body, const Vector& arm) const;
  void Push(const Unknown& u, int body, const Vector& arm, const Vector& f);
  Vector Gradient(const Unknown& u) const;
  void Change(const Unknown& u, const Vector& change);
  Active MakeActive(size_t i) const;
  bool Wants(size_t i, double cost_factor, double least) const;
  Vector Best(const Active& active, const Vector& pull, double cost) const;
  double Sweep(std::span<Active> island, double cost_factor, double faint_gain, bool backwards);
  void Repeat(std::span<Active> island, double share);
  void SolvePart(Part& solved, double cost_factor, double energy);
  void SolveIsland(std::span<Active> island, double cost_factor, double energy);
  static uint32_t PartOf(const Unknown& u);
  static bool AreNeighbours(const Part& one, const Part& other);
  std::vector<Island> FindIslands(std::vector<Active>& active) const;

  size_t frames_;
  std::vector<Row> rows_;
  std::vector<Unknown> unknowns_;
  std::vector<Vector> values_;
  std::vector<bool> allowed_;
};

}  // namespace carillon::motion
