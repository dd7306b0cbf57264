// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/contact_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carillon::motion {
namespace {

/// The cost of an impulse of 1 N s, m/s: a jump of the velocity below it is left unexplained.
constexpr double kCost = 0.005;
/// Blows cost more than loads, so that rest is a load.
constexpr double kBlowCost = 1.6;
/// A gap up to this share of the slack costs nothing: the next bin may be the right one.
constexpr double kFreeGap = 0.3;
/// The share of the costs that remains in the second solution, whose support is known.
constexpr double kBiasedShare = 0.02;
/// An unknown that explains less of a velocity stays zero, m/s.
constexpr double kLeastExplained = 2e-6;
/// A load around a blow that gives less than this share of its impulse may be part of it.
constexpr double kFaintShare = 0.2;
/// Impulses are joined if the momentum of no node becomes less explained by more than this share.
constexpr double kJoinedShare = 0.05;

/// A number from 1/2 to 2 for a candidate that does not depend on the order of candidates.
double Varied(const Candidate& candidate, int variant) {
  uint64_t hash = candidate.feature.key * 0x9E3779B97F4A7C15U +
                  candidate.pair * 0xC2B2AE3D27D4EB4FU +
                  static_cast<uint64_t>(variant) * 0x165667B19E3779F9U + candidate.frame * 31U +
                  static_cast<uint64_t>(candidate.bin + 1);
  hash = (hash ^ (hash >> 31U)) * 0xBF58476D1CE4E5B9U;
  hash ^= hash >> 29U;
  return std::exp2(2 * static_cast<double>(hash >> 11U) / static_cast<double>(uint64_t{1} << 53U) -
                   1);
}

}  // namespace

ContactProblem::ContactProblem(const Motion& motion, const SearchBodies& bodies,
                               const ContactSearch& search, std::vector<Candidate> candidates,
                               const std::vector<HopSeries>& series)
    : frames_(motion.frame_count()),
      frame_s_(motion.frame_s),
      bins_(static_cast<size_t>(search.bin_count())),
      pairs_(search.pairs()),
      candidates_(std::move(candidates)),
      given_(bodies.motions.size(), std::vector<std::vector<BodyImpulse>>(frames_ - 1)),
      blows_of_pair_(search.pairs().size()),
      loads_of_pair_(search.pairs().size()),
      balance_(bodies.motions.size(), motion.frame_count()) {
  for (const BodyMotion& body : bodies.motions) balanced_.push_back(body.balanced());
  for (const HopSeries& of : series) {
    for (const FoundBlow& blow : of.blows) AddGiven(bodies, blow);
  }
  AddNodes(motion, bodies, search);
  for (size_t i = 0; i < candidates_.size(); ++i) {
    AddUnknown(candidates_[i]);
    (candidates_[i].blow() ? blows_of_pair_ : loads_of_pair_)[candidates_[i].pair].push_back(i);
  }
  for (auto& blows : blows_of_pair_) {
    std::ranges::stable_sort(blows, {}, [&](size_t i) { return BinOf(candidates_[i]); });
  }
  AddJoints(motion, bodies);
}

void ContactProblem::AddNodes(const Motion& motion, const SearchBodies& bodies,
                              const ContactSearch& search) {
  for (size_t body = 0; body < bodies.motions.size(); ++body) {
    const BodyMotion& moves = bodies.motions[body];
    if (!moves.balanced()) continue;
    for (size_t k = 1; k + 1 < motion.frame_count(); ++k) {
      if (search.Skipped(body, k)) continue;
      Vector impulse = moves.Impulse(k), torque = moves.Torque(k);
      for (const size_t interval : {k - 1, k}) {
        for (const BodyImpulse& given : given_[body][interval]) {
          const double share = given.time_s / frame_s_, part = interval == k ? 1 - share : share;
          impulse -= part * given.impulse;
          torque -= part * given.torque;
        }
      }
      balance_.AddNode(body, k, moves.mass_kg(), moves.InverseInertia(k), impulse, torque);
    }
  }
}

void ContactProblem::AddGiven(const SearchBodies& bodies, const FoundBlow& blow) {
  for (const uint32_t body : {blow.a, blow.b}) {
    if (!balanced_[body]) continue;
    const BodyMotion& moves = bodies.motions[body];
    const Vector impulse = (body == blow.a ? 1 : -1) * blow.impulse_newton_seconds;
    const Vector arm = moves.At(blow.frame, blow.time_s, Path::kKnown).orientation *
                       ((body == blow.a ? blow.point_a_m : blow.point_b_m) - moves.centre_m());
    given_[body][blow.frame].push_back({blow.time_s, impulse, arm.cross(impulse)});
  }
}

void ContactProblem::AddUnknown(const Candidate& candidate) {
  const BodyPair& pair = pairs_[candidate.pair];
  Unknown unknown;
  unknown.a = balanced_[pair.a] ? static_cast<int>(pair.a) : -1;
  unknown.b = balanced_[pair.b] ? static_cast<int>(pair.b) : -1;
  unknown.arm_a = candidate.arm_a;
  unknown.arm_b = candidate.arm_b;
  unknown.normal = candidate.feature.normal;
  unknown.friction = pair.friction;
  if (candidate.blow()) {
    const double share = static_cast<double>(candidate.bin) / static_cast<double>(bins_);
    unknown.Touch(candidate.frame, 1 - share);
    if (share > 0) unknown.Touch(candidate.frame + 1, share);
  } else {
    const size_t first = candidate.frame, last = candidate.last_frame;
    const double h = frame_s_, end = last > first ? 5.0 / 6 : 4.0 / 6;
    unknown.Touch(first - 1, h / 6);
    unknown.Touch(first, h * end);
    if (last > first + 1) unknown.Touch(first + 1, h);
    if (last > first) unknown.Touch(last, h * end);
    unknown.Touch(last + 1, h / 6);
  }
  double square = 0;
  for (int i = 0; i < unknown.node_count; ++i) {
    square +=
        unknown.nodes[static_cast<size_t>(i)].weight * unknown.nodes[static_cast<size_t>(i)].weight;
  }
  // A body travels through the slack within a bin, less the tolerance.
  const double gap =
      std::max(0.0, std::abs(candidate.feature.gap_m) / candidate.slack_m - kFreeGap);
  unknown.cost =
      kCost * std::sqrt(square) * (1 + 3 * gap * gap) * (candidate.blow() ? kBlowCost : 1);
  balance_.Add(unknown);
}

void ContactProblem::AddJoints(const Motion& motion, const SearchBodies& bodies) {
  for (const Joint& joint : motion.joints) {
    const BodyMotion& first = bodies.motions[joint.body];
    for (size_t k = 1; k + 1 < frames_; ++k) {
      const BodyPose a = first.AtFrame(k);
      const Vector arm = a.orientation * (joint.anchor_m - first.centre_m());
      for (const UnknownKind kind : {UnknownKind::kJointForce, UnknownKind::kJointTorque}) {
        if (kind == UnknownKind::kJointTorque && joint.kind == JointKind::kBall) continue;
        Unknown unknown{
            .kind = kind, .a = first.balanced() ? static_cast<int>(joint.body) : -1, .arm_a = arm};
        if (joint.other >= 0 && balanced_[static_cast<size_t>(joint.other)]) {
          unknown.b = joint.other;
          const BodyPose b = bodies.motions[static_cast<size_t>(joint.other)].AtFrame(k);
          unknown.arm_b = a.position_m + arm - b.position_m;
        }
        if (joint.kind == JointKind::kHinge)
          unknown.normal = a.orientation * joint.axis.normalized();
        // An impulse at the frame alone: with its neighbours it is any force and any blow.
        unknown.Touch(k, 1);
        balance_.Add(unknown);
      }
    }
  }
}

size_t ContactProblem::BinOf(const Candidate& candidate) const {
  return candidate.frame * bins_ + static_cast<size_t>(std::max(0, candidate.bin));
}

double ContactProblem::TimeOf(const Candidate& candidate) const {
  return frame_s_ * static_cast<double>(BinOf(candidate)) / static_cast<double>(bins_);
}

/// Takes the blows around a cluster, and the loads around it that have little of its impulse.
void ContactProblem::AddMembers(uint32_t pair, double impulse, Cluster& cluster) const {
  const size_t first = std::min(cluster.first, cluster.middle - 1);
  const size_t last = std::max(cluster.last, cluster.middle + 1);
  for (const size_t i : blows_of_pair_[pair]) {
    const size_t bin = BinOf(candidates_[i]);
    if (bin >= first && bin <= last) cluster.members.push_back(i);
  }
  std::vector<size_t> loads;
  double given = 0;
  for (const size_t i : loads_of_pair_[pair]) {
    const Candidate& load = candidates_[i];
    if (load.frame > cluster.last / bins_ + 1 || load.last_frame < cluster.first / bins_) continue;
    given += balance_.value(i).norm() * frame_s_;
    if (!balance_.value(i).isZero(0)) loads.push_back(i);
  }
  if (given < kFaintShare * impulse) {
    cluster.members.insert(cluster.members.end(), loads.begin(), loads.end());
  }
}

/// Groups the blows of each pair that lie within the time of one frame.
std::vector<ContactProblem::Cluster> ContactProblem::FindClusters() const {
  std::vector<Cluster> clusters;
  for (uint32_t pair = 0; pair < blows_of_pair_.size(); ++pair) {
    Cluster cluster;
    double weight = 0, moment = 0;
    const auto close = [&] {
      if (weight > 0) {
        cluster.middle = std::max<size_t>(1, static_cast<size_t>(std::lround(moment / weight)));
        AddMembers(pair, weight, cluster);
        clusters.push_back(cluster);
      }
      cluster = {};
      weight = moment = 0;
    };
    for (const size_t i : blows_of_pair_[pair]) {
      const double size = balance_.value(i).norm();
      if (size == 0) continue;
      const size_t bin = BinOf(candidates_[i]);
      if (weight > 0 && bin > cluster.first + bins_) close();
      if (weight == 0) cluster.first = bin;
      cluster.last = bin;
      weight += size;
      moment += size * static_cast<double>(bin);
    }
    close();
  }
  return clusters;
}

double ContactProblem::ResidualAround(const Cluster& cluster, double& given) const {
  const BodyPair& pair = pairs_[candidates_[cluster.members.front()].pair];
  double residual = 0;
  given = 0;
  const size_t first = cluster.first / bins_;
  for (size_t k = first > 0 ? first - 1 : 0; k <= cluster.last / bins_ + 2 && k < frames_; ++k) {
    for (const uint32_t body : {pair.a, pair.b}) {
      residual += balance_.Residual(body, k);
      given += balance_.Given(body, k);
    }
  }
  return residual;
}

/// Moves the impulses of a cluster to the bins around their centre.
void ContactProblem::Join(Cluster& cluster) {
  for (const size_t i : cluster.members) {
    const size_t bin = BinOf(candidates_[i]);
    balance_.Allow(i,
                   candidates_[i].blow() && bin + 1 >= cluster.middle && bin <= cluster.middle + 1);
  }
}

void ContactProblem::Solve(int variant) {
  if (variant > 0) {
    for (size_t i = 0; i < candidates_.size(); ++i) {
      balance_.ScaleCost(i, Varied(candidates_[i], variant));
    }
  }
  balance_.Solve(1, kLeastExplained);
  std::vector<Cluster> clusters = FindClusters();
  balance_.AllowOnlyActive();
  balance_.Solve(kBiasedShare, kLeastExplained);
  if (variant > 0) return;
  std::vector<double> residuals;
  for (Cluster& cluster : clusters) {
    double given = 0;
    residuals.push_back(ResidualAround(cluster, given));
    for (size_t n = 0; n < cluster.members.size(); ++n) {
      cluster.before.push_back(balance_.value(cluster.members[n]));
    }
  }
  for (Cluster& cluster : clusters) Join(cluster);
  balance_.Solve(kBiasedShare, kLeastExplained);
  for (size_t c = 0; c < clusters.size(); ++c) {
    double given = 0;
    const double after = ResidualAround(clusters[c], given);
    if (std::sqrt(after) - std::sqrt(residuals[c]) <= kJoinedShare * std::sqrt(given)) continue;
    for (size_t n = 0; n < clusters[c].members.size(); ++n) {
      balance_.Allow(clusters[c].members[n], true);
      balance_.Set(clusters[c].members[n], clusters[c].before[n]);
    }
  }
  balance_.Solve(kBiasedShare, kLeastExplained);
}

/// Returns the times of all blows, s. Blows of a pair that cannot be told apart in time have their
/// mean time: if the corners of a face had times of their own, the face would land tilted.
std::vector<double> ContactProblem::BlowTimes() const {
  std::vector<double> times(candidates_.size(), 0);
  for (size_t i = 0; i < candidates_.size(); ++i) times[i] = TimeOf(candidates_[i]);
  for (const std::vector<size_t>& blows : blows_of_pair_) {
    std::vector<size_t> found;
    for (const size_t i : blows) {
      if (!balance_.value(i).isZero(0)) found.push_back(i);
    }
    for (size_t first = 0, end = 0; first < found.size(); first = end) {
      double sum = 0, moment = 0;
      const size_t first_bin = BinOf(candidates_[found[first]]);
      while (end < found.size() && BinOf(candidates_[found[end]]) <= first_bin + bins_) {
        const double size = balance_.value(found[end]).norm();
        sum += size;
        moment += size * TimeOf(candidates_[found[end++]]);
      }
      const size_t bins = BinOf(candidates_[found[end - 1]]) - first_bin;
      if (static_cast<double>(bins) >= kBinsAtOnce) continue;
      for (size_t i = first; i < end; ++i) times[found[i]] = moment / sum;
    }
  }
  return times;
}

void ContactProblem::Tell(std::vector<BodyMotion>& motions) const {
  const std::vector<double> times = BlowTimes();
  std::vector<std::vector<std::vector<BodyImpulse>>> impulses = given_;
  std::vector<std::vector<Vector>> forces(motions.size(),
                                          std::vector<Vector>(frames_, Vector::Zero()));
  for (size_t i = 0; i < candidates_.size(); ++i) {
    const Vector& f = balance_.value(i);
    if (f.isZero(0)) continue;
    const Candidate& c = candidates_[i];
    for (const double side : {1.0, -1.0}) {
      const uint32_t body = side > 0 ? pairs_[c.pair].a : pairs_[c.pair].b;
      if (!balanced_[body]) continue;
      const Vector& arm = side > 0 ? c.arm_a : c.arm_b;
      if (c.blow()) {
        const auto [frame, since_s] = FrameAt(times[i], frame_s_, frames_);
        impulses[body][frame].push_back({since_s, side * f, arm.cross(side * f)});
      } else {
        for (size_t k = c.frame; k <= c.last_frame; ++k) forces[body][k] += side * f;
      }
    }
  }
  for (size_t body = 0; body < motions.size(); ++body) {
    if (balanced_[body]) motions[body].Know(impulses[body], std::move(forces[body]));
  }
}

}  // namespace carillon::motion
