// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/momentum_balance.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "client_sdk/motion/in_parallel.h"

namespace carillon::motion {
namespace {

/// An island is solved when a sweep gains less than this share of its energy, in J per J. Where the
/// costs decide, they decide little, and sooner than that is soon enough.
constexpr double kEndShare = 1e-13, kEndShareOfCosts = 1e-6;
/// If all unknowns take part in a sweep, this share is soon enough as well.
constexpr double kEnoughShare = 1e-8;
/// An unknown whose change gains less than this share of the mean rests for some sweeps.
constexpr double kFaintGain = 0.01;
constexpr int kRestSweeps = 3;
/// The frames of a part of an island,
constexpr uint32_t kPartFrames = 32;
/// and the part of those unknowns that last longer.
constexpr uint32_t kLongPart = std::numeric_limits<uint32_t>::max();

Matrix Cross(const Vector& v) {
  Matrix m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// True in the cone |tangent| <= friction * normal component.
bool InCone(const Vector& f, const Vector& normal, double friction) {
  const double along = f.dot(normal);
  return along >= 0 && f.squaredNorm() <= (1 + friction * friction) * along * along;
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

/// Returns the velocity that a body lacks at the point of an unknown, by its weights; of a joint's
/// torque, the angular one.
Vector MomentumBalance::Missing(const Unknown& u, int body, const Vector& arm) const {
  if (body < 0) return Vector::Zero();
  const Row* rows = &row(body, 0);
  Vector velocity = Vector::Zero(), angular = Vector::Zero();
  for (int i = 0; i < u.node_count; ++i) {
    const auto& [frame, weight] = u.nodes[static_cast<size_t>(i)];
    velocity += weight * rows[frame].velocity;
    angular += weight * rows[frame].angular;
  }
  if (u.kind == UnknownKind::kJointTorque) return angular;
  return velocity + angular.cross(arm);
}

Vector MomentumBalance::Gradient(const Unknown& u) const {
  return Missing(u, u.a, u.arm_a) - Missing(u, u.b, u.arm_b);
}

void MomentumBalance::Push(const Unknown& u, int body, const Vector& arm, const Vector& f) {
  if (body < 0) return;
  Row* rows = &row(body, 0);
  const bool turns = u.kind == UnknownKind::kJointTorque;
  const Vector torque = turns ? f : arm.cross(f);
  for (int i = 0; i < u.node_count; ++i) {
    const auto& [frame, weight] = u.nodes[static_cast<size_t>(i)];
    Row& r = rows[frame];
    r.angular -= weight * (r.inverse_inertia * torque);
    if (!turns) r.velocity -= weight * r.inverse_mass * f;
  }
}

void MomentumBalance::Change(const Unknown& u, const Vector& change) {
  Push(u, u.a, u.arm_a, change);
  Push(u, u.b, u.arm_b, -change);
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

/// Returns an f of the cone that lessens 1/2 f' H f - pull' f + cost * normal component: the least
/// one, unless that slides. Then it is the best along the ray that a step down the gradient
/// reaches.
Vector MomentumBalance::Best(const Active& active, const Vector& pull, double cost) const {
  const Unknown& u = unknowns_[active.unknown];
  if (u.kind != UnknownKind::kContact) return active.inverse * pull;
  const Vector drive = pull - cost * u.normal;
  if (InCone(-drive, u.normal, 1 / u.friction)) return Vector::Zero();
  Vector f = active.inverse * drive;
  if (InCone(f, u.normal, u.friction)) return f;
  f = values_[active.unknown];
  f = Project(f + (drive - active.hessian * f) / active.largest, u.normal, u.friction);
  const double along = drive.dot(f);
  return along > 0 ? Vector(along / f.dot(active.hessian * f) * f) : Vector(Vector::Zero());
}

/// Improves each unknown in turn, and returns what the energy loses by it, J, twice.
double MomentumBalance::Sweep(std::span<Active> island, double cost_factor, double faint_gain,
                              bool backwards) {
  double gained = 0;
  for (size_t n = 0; n < island.size(); ++n) {
    Active& one = island[backwards ? island.size() - 1 - n : n];
    one.step.setZero();
    if (one.largest == 0 || one.rests-- > 0) continue;
    const Unknown& u = unknowns_[one.unknown];
    Vector& value = values_[one.unknown];
    const Vector pull = Gradient(u) + one.hessian * value;
    const Vector change = Best(one, pull, cost_factor * u.cost) - value;
    const double gain = change.dot(one.hessian * change);
    // The first to change may be the one that the sweep before has ended with, and gain nothing.
    one.rests = gain <= faint_gain && gained > 0 ? kRestSweeps : 0;
    if (gain == 0) continue;
    one.step = change;
    value += change;
    Change(u, change);
    gained += gain;
  }
  return gained;
}

/// Repeats the steps of the sweeps before, as conjugate gradients do, `share` times as large (M.
/// Silcowitz, S. Niebe and K. Erleben, A nonsmooth nonlinear conjugate gradient method for
/// interactive contact force problems, The Visual Computer 26, 2010). A share above 1 begins anew.
void MomentumBalance::Repeat(std::span<Active> island, double share) {
  for (Active& one : island) {
    if (share > 1) {
      one.direction = one.step;
      continue;
    }
    one.direction *= one.rests > 0 ? 0 : share;
    if (!one.direction.isZero(0)) {
      const Unknown& u = unknowns_[one.unknown];
      Vector& value = values_[one.unknown];
      Vector next = value + one.direction;
      if (u.kind == UnknownKind::kContact) next = Project(next, u.normal, u.friction);
      Change(u, next - value);
      value = next;
    }
    one.direction += one.step;
  }
}

/// Ends with a sweep of all unknowns that gains next to nothing: a blow at a frame and a load there
/// do nearly the same, and if one rested, they would stop each other halfway. A part that does not
/// come so far stays stale.
void MomentumBalance::SolvePart(Part& solved, double cost_factor, double energy) {
  const double end_gain = (cost_factor < 1 ? kEndShare : kEndShareOfCosts) * energy;
  const double enough_gain = std::max(end_gain, kEnoughShare * energy);
  constexpr int kMostSweeps = 30;
  const std::span<Active> part = solved.unknowns;
  double before = 0;
  bool all_took_part = true;
  for (Active& one : part) one.rests = 0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    const double faint = kFaintGain * before / static_cast<double>(part.size());
    const double gained = Sweep(part, cost_factor, faint, sweep % 2 == 1);
    solved.gained += gained;
    if (gained <= (all_took_part ? enough_gain : end_gain)) {
      if (all_took_part) {
        solved.stale = false;
        return;
      }
      for (Active& one : part) one.rests = 0;
      all_took_part = true;
      before = 0;
      continue;
    }
    all_took_part = false;
    Repeat(part, before > 0 ? gained / before : 2);
    before = gained;
  }
}

/// Solves for the unknowns of some frames at a time, until no part changes its neighbours. Parts
/// that are not neighbours share no node, and are solved in parallel.
void MomentumBalance::SolveIsland(std::span<Active> island, double cost_factor, double energy) {
  std::vector<Part> parts;
  for (size_t first = 0, end = 0; first < island.size(); first = end) {
    while (end < island.size() && island[end].part == island[first].part) ++end;
    parts.push_back({island[first].part, island.subspan(first, end - first)});
  }
  const double enough_gain = kEnoughShare * energy;
  constexpr int kMostRounds = 4;
  for (int round = 0; round < kMostRounds; ++round) {
    if (std::ranges::none_of(parts, &Part::stale)) return;
    for (const uint32_t turn : {0U, 1U, kLongPart}) {
      std::vector<Part*> now;
      for (Part& part : parts) {
        const uint32_t of = part.number == kLongPart ? kLongPart : part.number % 2;
        if (part.stale && of == turn) now.push_back(&part);
      }
      InParallel(now.size(), [&](size_t i) { SolvePart(*now[i], cost_factor, energy); });
      for (Part* const part : now) {
        if (std::exchange(part->gained, 0) <= enough_gain) continue;
        for (Part& other : parts) other.stale = other.stale || AreNeighbours(*part, other);
      }
    }
  }
}

/// Returns the number of the part of its island that an unknown belongs to.
uint32_t MomentumBalance::PartOf(const Unknown& u) {
  const uint32_t first = u.nodes[0].frame;
  const uint32_t last = u.nodes[static_cast<size_t>(u.node_count - 1)].frame;
  return last - first < kPartFrames ? first / kPartFrames : kLongPart;
}

/// True if two parts may share a node.
bool MomentumBalance::AreNeighbours(const Part& one, const Part& other) {
  if (one.number == kLongPart || other.number == kLongPart) return one.number != other.number;
  return one.number + 1 == other.number || other.number + 1 == one.number;
}

/// Sorts unknowns into islands, which share no node.
std::vector<MomentumBalance::Island> MomentumBalance::FindIslands(
    std::vector<Active>& active) const {
  std::vector<uint32_t> root(rows_.size());
  std::iota(root.begin(), root.end(), 0U);
  const auto find = [&](size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return static_cast<uint32_t>(i);
  };
  const auto of = [&](const Active& one) {
    const Unknown& u = unknowns_[one.unknown];
    return find(static_cast<size_t>(std::max(u.a, u.b)) * frames_ + u.nodes[0].frame);
  };
  for (const Active& one : active) {
    const Unknown& u = unknowns_[one.unknown];
    for (const int body : {u.a, u.b}) {
      for (int i = 0; body >= 0 && i < u.node_count; ++i) {
        root[find(static_cast<size_t>(body) * frames_ + u.nodes[static_cast<size_t>(i)].frame)] =
            of(one);
      }
    }
  }
  std::vector<double> energy(rows_.size(), 0);
  for (size_t i = 0; i < rows_.size(); ++i) energy[find(i)] += rows_[i].given;
  for (Active& one : active) {
    one.island = of(one);
    one.part = PartOf(unknowns_[one.unknown]);
  }
  const auto place = [](const Active& one) {
    return std::tuple(one.island, one.part, one.unknown);
  };
  std::ranges::sort(active, {}, place);
  std::vector<Island> islands;
  for (size_t i = 0; i < active.size(); ++i) {
    if (i == 0 || active[i].island != active[i - 1].island) {
      islands.push_back({.first = i, .energy = energy[active[i].island]});
    }
    ++islands.back().count;
  }
  return islands;
}

void MomentumBalance::Solve(double cost_factor, double least) {
  constexpr int kMostRounds = 3;
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
    const std::vector<Island> islands = FindIslands(active);
    InParallel(islands.size(), [&](size_t i) {
      SolveIsland(std::span(active).subspan(islands[i].first, islands[i].count), cost_factor,
                  islands[i].energy);
    });
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
  if (r.inverse_mass == 0) return 0;
  return r.velocity.squaredNorm() / r.inverse_mass +
         r.angular.dot(r.inverse_inertia.inverse() * r.angular);
}

}  // namespace carillon::motion
