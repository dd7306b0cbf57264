// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/blow_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

namespace carillon::motion {
namespace {

using Momentum = Eigen::Matrix<double, 6, 1>;  ///< linear, then angular
using Index = Eigen::Index;

/// The motions of the bodies follow the blows after each of these corrections.
constexpr int kCorrections = 3;
/// The number of steps of Levenberg's and Marquardt's method in a correction.
constexpr int kSteps = 8;
/// A change of an impulse or of its time costs this share of the energy that it would explain.
constexpr double kKeep = 0.01;
/// A blow is not corrected if other solutions explain the motion as well without this share of it.
constexpr double kMostAmbiguity = 0.3;
/// A group is not corrected if it has more unknowns than this share of its equations.
constexpr double kMostUnknown = 0.7;
/// Blows of a pair are not corrected if they are within this share of a body's radius of each
/// other.
constexpr double kApart = 0.25;
/// A correction counts if it lowers the unexplained energy of a group by this share at least.
constexpr double kLeastGain = 0.1;
/// Corners that cannot be told apart have one time if that leaves at most this share of their
/// energy unexplained.
constexpr double kMostLost = 0.01;
/// The correction of a group begins with one time if that leaves at most this share unexplained.
constexpr double kMostLostAtFirst = 0.1;

/// A blow while it is corrected.
struct Impact {
  FoundBlow* blow = nullptr;
  double friction = 0, per_kg = 0;
  Vector arm_a = Vector::Zero(), arm_b = Vector::Zero();
  Vector found = Vector::Zero(), impulse = Vector::Zero();
  size_t found_frame = 0, frame = 0;  ///< the one at or before the blow
  double found_share = 0, share = 0;  ///< of the interval that passes before the blow

  /// How many frames later it is than it was found.
  double Later() const {
    return static_cast<double>(frame) - static_cast<double>(found_frame) + share - found_share;
  }
  /// The part of the impulse that the balance at a frame has.
  double PartAt(size_t node) const {
    if (node == frame) return 1 - share;
    return node == frame + 1 ? share : 0;
  }

  bool strikes(size_t body) const { return blow->a == body || blow->b == body; }
  Vector On(size_t body) const { return blow->a == body ? impulse : Vector(-impulse); }
  const Vector& ArmOf(size_t body) const { return blow->a == body ? arm_a : arm_b; }
  /// The momentum that the impulse gives a body.
  Momentum Given(size_t body) const {
    Momentum given;
    given << On(body), ArmOf(body).cross(On(body));
    return given;
  }
};

/// The balance of a body at a frame.
struct Node {
  size_t body = 0, frame = 0;
  double root_mass = 1;              ///< divides a linear momentum, kg^(1/2)
  Matrix root = Matrix::Identity();  ///< multiplies an angular one, (kg m^2)^(-1/2)

  /// Scales a momentum to the root of an energy, J^(1/2).
  Momentum Scaled(const Momentum& momentum) const {
    Momentum scaled;
    scaled << momentum.head<3>() / root_mass, root * momentum.tail<3>();
    return scaled;
  }
};

/// Blows in one interval that share bodies.
struct Group {
  std::vector<size_t> members;
  size_t interval = 0;
  std::vector<size_t> bodies;  ///< those that are balanced
  std::vector<Node> nodes;
  /// What the bodies knew before in the interval, and in neighbours in which nothing strikes them.
  std::map<std::pair<size_t, size_t>, std::vector<BodyImpulse>> known;
  double unexplained = 0, unexplained_as_read = 0;  ///< before correction, J
  double least_gain = 0;                            ///< by which correction must lower it, J
};

class Refinement {
 public:
  Refinement(const Motion& motion, const std::vector<BodyPair>& pairs, SearchBodies& bodies,
             FoundContacts& found)
      : motion_(motion), bodies_(bodies), found_(found) {
    std::map<std::pair<uint32_t, uint32_t>, double> friction;
    for (const BodyPair& pair : pairs) friction[{pair.a, pair.b}] = pair.friction;
    for (FoundBlow& blow : found.blows) {
      Impact impact{.blow = &blow, .friction = friction[{blow.a, blow.b}]};
      for (const uint32_t body : {blow.a, blow.b}) {
        if (balanced(body)) impact.per_kg += 1 / bodies.motions[body].mass_kg();
      }
      impact.found = blow.balanced_newton_seconds;
      const auto [frame, since_s] = FrameAt(blow.balanced_s, motion.frame_s, motion.frame_count());
      impact.found_frame = frame;
      impact.found_share = since_s / motion.frame_s;
      impacts_.push_back(impact);
    }
    FindGroups();
  }

  void Run() {
    ChooseForGroups();
    for (int pass = 0; pass <= kCorrections; ++pass) {
      SetArms();
      SetRows();
      for (Group& group : groups_) {
        const double energy = Residual(group).squaredNorm();
        if (pass == kCorrections && energy > group.unexplained - group.least_gain) Revert(group);
        if (pass < kCorrections) Improve(group);
      }
      for (const Group& group : groups_) {
        if (pass < kCorrections) Tell(group);
      }
    }
    for (const Impact& impact : impacts_) {
      impact.blow->impulse_newton_seconds = impact.impulse;
      impact.blow->frame = impact.frame;
      impact.blow->time_s = impact.share * motion_.frame_s;
    }
    std::erase_if(found_.blows,
                  [](const FoundBlow& blow) { return blow.impulse_newton_seconds.isZero(0); });
    std::ranges::stable_sort(found_.blows, {}, [this](const FoundBlow& blow) {
      return blow.SinceFirst(motion_.frame_s);
    });
  }

 private:
  bool balanced(size_t body) const { return bodies_.motions[body].balanced(); }
  bool has_row(size_t body, size_t frame) const {
    return balanced(body) && frame > 0 && frame + 1 < motion_.frame_count();
  }
  Momentum& row(size_t body, size_t frame) { return rows_[body * motion_.frame_count() + frame]; }

  void FindGroups() {
    std::vector<size_t> parent(impacts_.size());
    std::iota(parent.begin(), parent.end(), size_t{0});
    const auto root = [&parent](size_t i) {
      while (parent[i] != i) i = parent[i];
      return i;
    };
    for (size_t i = 0; i < impacts_.size(); ++i) {
      const FoundBlow& blow = *impacts_[i].blow;
      for (const uint32_t body : {blow.a, blow.b}) {
        if (!balanced(body)) continue;
        const auto [other, is_new] = struck_.try_emplace({impacts_[i].found_frame, body}, i);
        if (!is_new) parent[root(i)] = root(other->second);
      }
    }
    std::map<size_t, Group> groups;
    for (size_t i = 0; i < impacts_.size(); ++i) groups[root(i)].members.push_back(i);
    for (auto& [_, group] : groups) {
      Complete(group);
      groups_.push_back(std::move(group));
    }
  }

  /// Takes a blow as it balances the momenta, or as it was read.
  void Take(Impact& impact, bool as_read) const {
    const FoundBlow& blow = *impact.blow;
    impact.impulse = as_read ? blow.impulse_newton_seconds : impact.found;
    impact.frame = as_read ? blow.frame : impact.found_frame;
    impact.share = as_read ? blow.time_s / motion_.frame_s : impact.found_share;
  }

  /// Takes each group as it balances the momenta. A group that may not be corrected is taken as it
  /// was read, unless that loses too much momentum.
  void ChooseForGroups() {
    for (const bool as_read : {true, false}) {
      for (Impact& impact : impacts_) Take(impact, as_read);
      SetArms();
      SetRows();
      for (Group& group : groups_) {
        if (as_read) group.unexplained_as_read = Residual(group).squaredNorm();
        if (!as_read) SetUnexplained(group);
      }
    }
    std::erase_if(groups_, [this](const Group& group) {
      const bool may_improve = MayImprove(group);
      const double most_lost = may_improve ? kMostLostAtFirst : kMostLost;
      for (const size_t i : group.members) Take(impacts_[i], MayBeAsRead(group, most_lost));
      return !may_improve;
    });
  }

  bool MayBeAsRead(const Group& group, double most_lost) const {
    double given = 0;
    for (const size_t i : group.members) {
      given += impacts_[i].found.squaredNorm() * impacts_[i].per_kg;
    }
    return group.unexplained_as_read < group.unexplained + most_lost * given;
  }

  void Complete(Group& group) const {
    group.interval = impacts_[group.members.front()].found_frame;
    for (size_t body = 0; body < bodies_.motions.size(); ++body) {
      const auto strikes = [&](size_t i) { return impacts_[i].strikes(body); };
      if (!balanced(body) || !std::ranges::any_of(group.members, strikes)) continue;
      const BodyMotion& moves = bodies_.motions[body];
      group.bodies.push_back(body);
      for (size_t frame = group.interval - std::min<size_t>(group.interval, 1);
           frame <= group.interval + 2; ++frame) {
        if (!has_row(body, frame)) continue;
        if (frame == group.interval ||
            (frame < group.interval + 2 && !struck_.contains({frame, body}))) {
          group.known[{body, frame}] = moves.known_impulses(frame);
        }
        group.nodes.push_back({.body = body,
                               .frame = frame,
                               .root_mass = std::sqrt(moves.mass_kg()),
                               .root = moves.InverseInertia(frame).llt().matrixU()});
      }
    }
  }

  bool MayImprove(const Group& group) const {
    const auto has_joint = [&](size_t body) {
      return std::ranges::any_of(motion_.joints, [body](const Joint& joint) {
        return joint.body == body || joint.other == static_cast<int>(body);
      });
    };
    const auto is_ambiguous = [&](size_t i) {
      return impacts_[i].blow->ambiguity > kMostAmbiguity;
    };
    const auto is_near = [&](size_t i, size_t k) {
      const FoundBlow &one = *impacts_[i].blow, &other = *impacts_[k].blow;
      if (i == k || one.a != other.a || one.b != other.b) return false;
      const double radius_m =
          std::min(bodies_.motions[one.a].radius_m(), bodies_.motions[one.b].radius_m());
      return (one.point_a_m - other.point_a_m).norm() < kApart * radius_m;
    };
    const auto has_near = [&](size_t i) {
      return std::ranges::any_of(group.members, [&](size_t k) { return is_near(i, k); });
    };
    const double unknown = 4 * static_cast<double>(group.members.size());
    const double equations = 12 * static_cast<double>(group.bodies.size());
    return unknown <= kMostUnknown * equations &&
           std::ranges::none_of(group.members, is_ambiguous) &&
           std::ranges::none_of(group.members, has_near) &&
           std::ranges::none_of(group.bodies, has_joint);
  }

  /// Tells the motions of the bodies the impulses of a group.
  void Tell(const Group& group) {
    for (const auto& [place, known] : group.known) {
      const auto& [body, interval] = place;
      std::vector<BodyImpulse> impulses;
      for (const size_t i : group.members) {
        const Impact& impact = impacts_[i];
        if (!impact.strikes(body) || impact.frame != interval) continue;
        const Vector f = impact.On(body);
        impulses.push_back({impact.share * motion_.frame_s, f, impact.ArmOf(body).cross(f)});
      }
      const bool may_be_as_before = impulses.empty() && interval != group.interval;
      bodies_.motions[body].Know(interval, may_be_as_before ? known : impulses);
    }
  }

  void Revert(const Group& group) {
    for (const size_t i : group.members) Take(impacts_[i], MayBeAsRead(group, kMostLost));
    for (const auto& [place, known] : group.known) {
      const auto& [body, interval] = place;
      bodies_.motions[body].Know(interval, known);
    }
  }

  Vector ArmOf(uint32_t body, const BodyPose& pose, const Vector& point_m) const {
    return pose.orientation * (point_m - bodies_.motions[body].centre_m());
  }

  void SetArms() {
    for (Impact& impact : impacts_) {
      const FoundBlow& blow = *impact.blow;
      const double time_s = impact.share * motion_.frame_s;
      const auto arm = [&](uint32_t body, const Vector& point_m) {
        return ArmOf(body, bodies_.motions[body].At(impact.frame, time_s, Path::kKnown), point_m);
      };
      impact.arm_a = arm(blow.a, blow.point_a_m);
      impact.arm_b = arm(blow.b, blow.point_b_m);
    }
  }

  void AddBlow(const Impact& impact, double factor) {
    for (const uint32_t body : {impact.blow->a, impact.blow->b}) {
      const Momentum given = factor * impact.Given(body);
      for (const size_t frame : {impact.frame, impact.frame + 1}) {
        if (has_row(body, frame)) row(body, frame) += impact.PartAt(frame) * given;
      }
    }
  }

  /// Sets what the blows and the loads leave unbalanced.
  void SetRows() {
    const size_t frames = motion_.frame_count();
    rows_.assign(bodies_.motions.size() * frames, Momentum::Zero());
    for (size_t body = 0; body < bodies_.motions.size(); ++body) {
      for (size_t k = 1; k + 1 < frames && balanced(body); ++k) {
        row(body, k) << bodies_.motions[body].Impulse(k), bodies_.motions[body].Torque(k);
      }
    }
    for (const FoundLoad& load : found_.loads) {
      AddLoad(load, load.a, load.point_a_m, load.force_newtons);
      AddLoad(load, load.b, load.point_b_m, -load.force_newtons);
    }
    for (const Impact& impact : impacts_) AddBlow(impact, -1);
  }

  void AddLoad(const FoundLoad& load, uint32_t body, const Vector& point_m, const Vector& force) {
    const Vector arm = ArmOf(body, bodies_.motions[body].AtFrame(load.frame), point_m);
    Momentum given;
    given << force, arm.cross(force);
    for (size_t k = load.frame > 0 ? load.frame - 1 : 0; k <= load.frame + 1; ++k) {
      if (has_row(body, k)) {
        row(body, k) -= motion_.frame_s * (k == load.frame ? 4.0 : 1.0) / 6 * given;
      }
    }
  }

  Eigen::VectorXd Residual(const Group& group) {
    Eigen::VectorXd residual(static_cast<Index>(6 * group.nodes.size()));
    for (size_t n = 0; n < group.nodes.size(); ++n) {
      const Node& node = group.nodes[n];
      residual.segment<6>(static_cast<Index>(6 * n)) = node.Scaled(row(node.body, node.frame));
    }
    return residual;
  }

  void SetUnexplained(Group& group) {
    double own = 0;
    for (const Node& node : group.nodes) {
      const double energy = node.Scaled(row(node.body, node.frame)).squaredNorm();
      group.unexplained += energy;
      if (node.frame == group.interval || node.frame == group.interval + 1) own += energy;
    }
    group.least_gain = kLeastGain * own;
  }

  /// What a group gives its nodes for a change of its unknowns. Each blow has four: its impulse,
  /// and its share times the length of the impulse that was found, N s.
  Eigen::MatrixXd Derivatives(const Group& group) const {
    Eigen::MatrixXd derivatives = Eigen::MatrixXd::Zero(
        static_cast<Index>(6 * group.nodes.size()), static_cast<Index>(4 * group.members.size()));
    for (size_t n = 0; n < group.nodes.size(); ++n) {
      const Node& node = group.nodes[n];
      for (size_t m = 0; m < group.members.size(); ++m) {
        const Impact& impact = impacts_[group.members[m]];
        if (!impact.strikes(node.body)) continue;
        auto block = derivatives.block<6, 4>(static_cast<Index>(6 * n), static_cast<Index>(4 * m));
        Impact unit = impact;
        for (Index axis = 0; axis < 3; ++axis) {
          unit.impulse = Vector::Unit(axis);
          block.col(axis) = impact.PartAt(node.frame) * node.Scaled(unit.Given(node.body));
        }
        const double later = node.frame == impact.frame + 1 ? 1
                             : node.frame == impact.frame   ? -1
                                                            : 0;
        block.col(3) = later * node.Scaled(impact.Given(node.body)) / impact.found.norm();
      }
    }
    return derivatives;
  }

  /// Returns the differences of a group's unknowns from those that the balance found.
  Eigen::VectorXd Moved(const Group& group) const {
    Eigen::VectorXd moved(static_cast<Index>(4 * group.members.size()));
    for (size_t m = 0; m < group.members.size(); ++m) {
      const Impact& impact = impacts_[group.members[m]];
      moved.segment<4>(static_cast<Index>(4 * m)) << impact.impulse - impact.found,
          impact.found.norm() * impact.Later();
    }
    return moved;
  }

  void Move(const Group& group, const Eigen::VectorXd& changes) {
    for (size_t m = 0; m < group.members.size(); ++m) {
      Impact& impact = impacts_[group.members[m]];
      const auto change = changes.segment<4>(static_cast<Index>(4 * m));
      AddBlow(impact, 1);
      impact.impulse += change.head<3>();
      impact.share += change[3] / impact.found.norm();
      Project(impact);
      AddBlow(impact, -1);
    }
  }

  /// Returns whether a blow may move to an interval: to the one in which it was found, or to a
  /// neighbour if nothing else strikes its bodies there or just beyond.
  bool MayBeIn(const Impact& impact, size_t interval) const {
    const size_t found = impact.found_frame;
    if (interval == found) return true;
    if (interval + 1 < found || interval > found + 1) return false;
    const size_t beyond = 2 * interval - std::min(found, 2 * interval);
    return std::ranges::all_of(std::array{impact.blow->a, impact.blow->b}, [&](size_t body) {
      return !balanced(body) ||
             (has_row(body, interval) && has_row(body, interval + 1) &&
              !struck_.contains({interval, body}) && !struck_.contains({beyond, body}));
    });
  }

  /// Brings an impulse back into its cone of friction, and its time into an interval.
  void Project(Impact& impact) const {
    if (impact.share > 1 && MayBeIn(impact, impact.frame + 1)) {
      ++impact.frame;
      impact.share -= 1;
    } else if (impact.share < 0 && impact.frame > 0 && MayBeIn(impact, impact.frame - 1)) {
      --impact.frame;
      impact.share += 1;
    }
    impact.share = std::clamp(impact.share, 0.0, 1.0);
    const Vector& normal = impact.blow->normal;
    const double pressed = std::max(0.0, normal.dot(impact.impulse));
    Vector along = impact.impulse - normal.dot(impact.impulse) * normal;
    const double most = impact.friction * pressed;
    if (along.norm() > most) along *= most / along.norm();
    impact.impulse = pressed * normal + along;
  }

  /// Corrects a group by the method of Levenberg and Marquardt, with all others as they are.
  void Improve(const Group& group) {
    Eigen::VectorXd weights(static_cast<Index>(4 * group.members.size()));
    for (size_t m = 0; m < group.members.size(); ++m) {
      weights.segment<4>(static_cast<Index>(4 * m)).setConstant(impacts_[group.members[m]].per_kg);
    }
    const auto energy = [&] {
      return Residual(group).squaredNorm() + kKeep * weights.dot(Moved(group).cwiseAbs2());
    };
    double damping = 1e-6, least = energy();
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::MatrixXd derivatives = Derivatives(group);
      Eigen::MatrixXd hessian = derivatives.transpose() * derivatives;
      hessian.diagonal() += (kKeep + damping) * weights;
      const Eigen::VectorXd pull =
          derivatives.transpose() * Residual(group) - kKeep * weights.cwiseProduct(Moved(group));
      std::vector<Impact> before;
      for (const size_t i : group.members) before.push_back(impacts_[i]);
      Move(group, hessian.ldlt().solve(pull));
      const double now = energy();
      if (now < least) {
        damping /= 10;
        if (now > 0.999 * std::exchange(least, now)) return;
        continue;
      }
      for (size_t m = 0; m < group.members.size(); ++m) {
        AddBlow(impacts_[group.members[m]], 1);
        impacts_[group.members[m]] = before[m];
        AddBlow(before[m], -1);
      }
      damping *= 100;
    }
  }

  const Motion& motion_;
  SearchBodies& bodies_;
  FoundContacts& found_;
  std::vector<Impact> impacts_;
  std::vector<Group> groups_;
  /// The first blow in an interval on a body.
  std::map<std::pair<size_t, size_t>, size_t> struck_;
  std::vector<Momentum> rows_;  ///< what each body lacks at each frame
};

}  // namespace

void RefineBlows(const Motion& motion, const std::vector<BodyPair>& pairs, SearchBodies& bodies,
                 FoundContacts& found) {
  if (found.blows.empty() || motion.frames_are_steps) return;
  Refinement(motion, pairs, bodies, found).Run();
}

}  // namespace carillon::motion
