// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/contact_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "client_sdk/motion/in_parallel.h"

namespace carillon::motion {
namespace {

/// Below this speed, m/s, of all its points a body is still.
constexpr double kStillSpeed = 0.002;
/// The time between two blows that are told apart, s, as far as the frames allow.
constexpr double kBinS = 0.004;

/// The gap at rest is that of this number of frames at least.
constexpr size_t kGaps = 3;
/// A force is steady if it changes by less than this share from frame to frame.
constexpr double kSteady = 0.1;

double TolerancesOf(double a, double b) { return 0.01 * std::min(a, b); }

/// Leaves one of the features that lie at one place, such as all corners of a sphere's core: the
/// balance of contacts that do the same converges slowly.
void MergeCoincident(double tolerance_m, std::vector<ContactFeature>& features) {
  std::vector<ContactFeature> apart;
  for (const ContactFeature& feature : features) {
    const auto coincides = [&](const ContactFeature& other) {
      return (feature.point_a - other.point_a).norm() < tolerance_m &&
             (feature.point_b - other.point_b).norm() < tolerance_m;
    };
    if (std::ranges::none_of(apart, coincides)) apart.push_back(feature);
  }
  features = std::move(apart);
}

}  // namespace

ContactSearch::ContactSearch(const Motion& motion, const SearchBodies& bodies)
    : motion_(motion),
      bodies_(bodies),
      frames_(motion.frame_count()),
      bin_count_(
          motion.frames_are_steps || motion.frame_s < 0.6 * kBinS
              ? 1
              : static_cast<int>(std::clamp(std::round(motion.frame_s / kBinS), 2.0, 10.0))) {
  const size_t count = bodies.motions.size();
  still_.assign(count, std::vector<bool>(frames_, true));
  acts_.assign(count, std::vector<bool>(frames_, false));
  skipped_.assign(count, std::vector<bool>(frames_, false));
  for (size_t body = 0; body < count; ++body) {
    for (size_t frame = 0; frame < frames_; ++frame) {
      still_[body][frame] = Still(body, frame);
      acts_[body][frame] = Acts(body, frame);
    }
  }
  FindPairs();
}

bool ContactSearch::Still(size_t body, size_t frame) const {
  const BodyMotion& motion = bodies_.motions[body];
  return motion.Speed(frame > 0 ? frame - 1 : 0) < kStillSpeed &&
         motion.Speed(std::min(frame, frames_ - 2)) < kStillSpeed;
}

bool ContactSearch::Acts(size_t body, size_t node) const {
  const BodyMotion& motion = bodies_.motions[body];
  if (!motion.balanced()) return true;
  if (node == 0 || node + 1 >= frames_) return false;
  return motion.Jump(node) > bodies_.free_speed[body];
}

void ContactSearch::FindPairs() {
  const size_t count = bodies_.motions.size();
  for (uint32_t a = 0; a < count; ++a) {
    for (uint32_t b = a + 1; b < count; ++b) {
      const BodyMotion &one = bodies_.motions[a], &two = bodies_.motions[b];
      if (!one.balanced() && !two.balanced()) continue;
      const auto joins = [a, b](const Joint& joint) {
        return (joint.body == a && joint.other == static_cast<int>(b)) ||
               (joint.body == b && joint.other == static_cast<int>(a));
      };
      if (std::ranges::any_of(motion_.joints, joins)) continue;
      BodyPair pair{.a = a, .b = b};
      pair.tolerance_m = TolerancesOf(one.radius_m(), two.radius_m());
      pair.reduced_mass_kg =
          1 / ((one.balanced() ? 1 / one.mass_kg() : 0) + (two.balanced() ? 1 / two.mass_kg() : 0));
      pair.rounding_m = motion_.bodies[a].rounding_m + motion_.bodies[b].rounding_m;
      pair.friction = std::sqrt(motion_.bodies[a].friction * motion_.bodies[b].friction);
      pairs_.push_back(pair);
    }
  }
}

bool ContactSearch::Near(const BodyPair& pair, size_t frame, double margin_m) const {
  const BodyPose a = bodies_.motions[pair.a].AtFrame(frame);
  const BodyPose b = bodies_.motions[pair.b].AtFrame(frame);
  const auto apart = [&](const BodyPose& ball, const BodyPose& box, uint32_t of, uint32_t on) {
    const Vector centre = bodies_.motions[on].centre_m() +
                          box.orientation.conjugate() * (ball.position_m - box.position_m);
    const double reach = bodies_.motions[of].radius_m() + pair.rounding_m + margin_m;
    return bodies_.surfaces[on]->box().squaredExteriorDistance(centre) > reach * reach;
  };
  return !apart(a, b, pair.a, pair.b) && !apart(b, a, pair.b, pair.a);
}

double ContactSearch::Slack(const BodyPair& pair, size_t interval) const {
  double speed = 0;
  const size_t last = frames_ - 2;
  for (const size_t k :
       {interval > 0 ? interval - 1 : 0, std::min(interval, last), std::min(interval + 1, last)}) {
    speed = std::max(speed, bodies_.motions[pair.a].Speed(k) + bodies_.motions[pair.b].Speed(k));
  }
  return pair.tolerance_m + speed * motion_.frame_s / bin_count_;
}

PairPlacement ContactSearch::Place(const BodyPair& pair, size_t interval, double time_s,
                                   Path path) const {
  const auto place = [&](uint32_t body) {
    const BodyMotion& motion = bodies_.motions[body];
    BodyPose pose = path == Path::kBetween && time_s == 0 ? motion.AtFrame(interval)
                                                          : motion.At(interval, time_s, path);
    pose.position_m -= pose.orientation * motion.centre_m();
    return pose;
  };
  return {place(pair.a), place(pair.b)};
}

/// The features of both surfaces, moved outward by their rounding. A step of a simulator pushes all
/// corners at once that would otherwise pass the surface within it; in continuous time only the
/// first ones.
std::vector<ContactFeature> ContactSearch::Features(const BodyPair& pair, const PairPlacement& at,
                                                    double reach_m) const {
  std::vector<ContactFeature> features = FindFeatures(
      *bodies_.surfaces[pair.a], *bodies_.surfaces[pair.b], at, reach_m + pair.rounding_m,
      motion_.frames_are_steps ? std::nullopt : std::optional(3 * pair.tolerance_m));
  if (pair.rounding_m == 0) return features;
  MergeCoincident(0.01 * pair.tolerance_m, features);
  const auto in_scene = [](const BodyPose& pose, const Vector& point) {
    return Vector(pose.position_m + pose.orientation * point);
  };
  for (ContactFeature& feature : features) {
    const Vector apart = in_scene(at.a, feature.point_a) - in_scene(at.b, feature.point_b);
    // Round corners and edges meet along the line between them.
    if (feature.gap_m > 0.1 * pair.rounding_m) feature.normal = apart.normalized();
    feature.gap_m -= pair.rounding_m;
    feature.point_a -=
        at.a.orientation.conjugate() * (motion_.bodies[pair.a].rounding_m * feature.normal);
    feature.point_b +=
        at.b.orientation.conjugate() * (motion_.bodies[pair.b].rounding_m * feature.normal);
  }
  return features;
}

void ContactSearch::FindAtFrames(size_t p, std::vector<PairFrame>& frames) const {
  const BodyPair& pair = pairs_[p];
  frames.resize(frames_);
  for (size_t k = 1; k + 1 < frames_; ++k) {
    PairFrame& frame = frames[k];
    frame.slack_m = Slack(pair, k);
    frame.still = still_[pair.a][k] && still_[pair.b][k];
    if (frame.still && frames[k - 1].still) {
      frame.features = frames[k - 1].features;
      continue;
    }
    const double reach = frame.slack_m + 4 * pair.tolerance_m;
    if (!Near(pair, k, reach)) continue;
    frame.features = Features(pair, Place(pair, k, 0, Path::kBetween), reach);
  }
}

/// Engines keep bodies apart by a margin, or let them overlap. The gap at rest is the least known.
/// A body that hops is above it in most frames, so that gaps under a steady force count first.
void ContactSearch::FindOffset(BodyPair& pair, const std::vector<PairFrame>& frames) const {
  const auto is_steady = [&](uint32_t body, size_t k) {
    const BodyMotion& moves = bodies_.motions[body];
    if (!moves.balanced()) return true;
    const Vector before = moves.Impulse(k - 1), here = moves.Impulse(k),
                 after = moves.Impulse(k + 1);
    const double most = kSteady * here.norm();
    return (here - before).norm() < most && (here - after).norm() < most;
  };
  std::vector<double> gaps, steady_gaps;
  for (size_t k = 0; k < frames_; ++k) {
    const PairFrame& frame = frames[k];
    if (frame.features.empty()) continue;
    const double gap = std::ranges::min_element(frame.features, {}, &ContactFeature::gap_m)->gap_m;
    pair.nearest_m = std::min(pair.nearest_m, gap);
    if (frame.slack_m >= 3 * pair.tolerance_m || std::abs(gap) >= 5 * pair.tolerance_m) continue;
    gaps.push_back(gap);
    if (k > 1 && k + 2 < frames_ && is_steady(pair.a, k) && is_steady(pair.b, k)) {
      steady_gaps.push_back(gap);
    }
  }
  if (steady_gaps.size() >= kGaps) gaps = std::move(steady_gaps);
  if (gaps.size() < kGaps) return;
  std::ranges::nth_element(gaps, gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2));
  pair.offset_m = gaps[gaps.size() / 2];
}

/// Leaves `still` true only where all bodies of a pile are still, and where the pile was the same
/// in the frame before.
void ContactSearch::MarkPiles(std::vector<std::vector<PairFrame>>& frames) {
  const size_t count = bodies_.motions.size();
  std::vector<size_t> before(count, 0), now(count, 0), root(count);
  for (size_t k = 1; k + 1 < frames_; ++k) {
    std::iota(root.begin(), root.end(), size_t{0});
    const auto find = [&root](size_t i) {
      while (root[i] != i) i = root[i] = root[root[i]];
      return i;
    };
    for (size_t p = 0; p < pairs_.size(); ++p) {
      const BodyPair& pair = pairs_[p];
      if (frames[p][k].features.empty()) continue;
      if (bodies_.motions[pair.a].balanced() && bodies_.motions[pair.b].balanced()) {
        root[find(pair.a)] = find(pair.b);
      }
    }
    std::vector<size_t> sum(count, 0);
    std::vector<bool> moving(count, false);
    for (size_t p = 0; p < pairs_.size(); ++p) {
      if (frames[p][k].features.empty()) continue;
      const size_t body = bodies_.motions[pairs_[p].a].balanced() ? pairs_[p].a : pairs_[p].b;
      sum[find(body)] += (p + 1) * 0x9E3779B97F4A7C15U;
      if (!frames[p][k].still) moving[find(body)] = true;
    }
    for (size_t body = 0; body < count; ++body) {
      const size_t of = find(body);
      now[body] = moving[of] || !still_[body][k] ? 0 : sum[of];
    }
    for (size_t p = 0; p < pairs_.size(); ++p) {
      const size_t body = bodies_.motions[pairs_[p].a].balanced() ? pairs_[p].a : pairs_[p].b;
      frames[p][k].still = now[body] != 0;
    }
    for (size_t body = 0; body < count; ++body) {
      // A run of the same pile is looked at in its first two nodes and its last one.
      skipped_[body][k] = now[body] != 0 && now[body] == before[body];
    }
    before = now;
  }
}

void ContactSearch::Add(Candidate candidate, double time_s, Path path,
                        std::vector<Candidate>& out) const {
  const BodyPair& pair = pairs_[candidate.pair];
  const auto arm = [&](uint32_t body, const Vector& point) {
    const BodyMotion& motion = bodies_.motions[body];
    const Turn turn = candidate.blow() ? motion.At(candidate.frame, time_s, path).orientation
                                       : motion.AtFrame(candidate.frame).orientation;
    return Vector(turn * (point - motion.centre_m()));
  };
  candidate.arm_a = arm(pair.a, candidate.feature.point_a);
  candidate.arm_b = arm(pair.b, candidate.feature.point_b);
  if (!motion_.frames_are_steps) {
    const double approach_m = ApproachSpeed(candidate) * motion_.frame_s / bin_count_;
    candidate.slack_m = std::min(candidate.slack_m, pair.tolerance_m + approach_m);
  }
  if (std::abs(candidate.feature.gap_m) > candidate.slack_m) return;
  // A step of a simulator may push several points at once that part after the first push.
  if (candidate.blow() && !motion_.frames_are_steps && IsOfFarSide(candidate)) return;
  out.push_back(candidate);
}

/// Returns a bound on how fast the gap of a candidate grows or shrinks, m/s: the greatest of the
/// mean speeds of the intervals around it, plus the speed that gravity adds within one interval.
/// Bodies that move together do not approach each other, however fast they are.
double ContactSearch::ApproachSpeed(const Candidate& candidate) const {
  const BodyPair& pair = pairs_[candidate.pair];
  const size_t last = std::min<size_t>(candidate.frame + 1, frames_ - 2);
  double speed = 0;
  for (size_t k = std::max<size_t>(candidate.frame, 1) - 1; k <= last; ++k) {
    const Vector parting = bodies_.motions[pair.a].MeanVelocity(k, candidate.arm_a) -
                           bodies_.motions[pair.b].MeanVelocity(k, candidate.arm_b);
    speed = std::max(speed, std::abs(candidate.feature.normal.dot(parting)));
  }
  if (bodies_.motions[pair.a].balanced() == bodies_.motions[pair.b].balanced()) return speed;
  return speed + std::abs(candidate.feature.normal.dot(motion_.gravity_m_per_s2)) * motion_.frame_s;
}

/// True if a blow deep inside a body would push against what happens there: the bodies part before
/// it, and more slowly after it than free flight would let them. On its way into a thin body the
/// other one passes the middle, from where the far side is the nearest.
bool ContactSearch::IsOfFarSide(const Candidate& candidate) const {
  const BodyPair& pair = pairs_[candidate.pair];
  if (candidate.feature.gap_m > -3 * pair.tolerance_m) return false;
  const BodyMotion &a = bodies_.motions[pair.a], &b = bodies_.motions[pair.b];
  const Vector& normal = candidate.feature.normal;
  const size_t first = std::max<size_t>(candidate.frame, 1) - 1;
  const size_t last = std::min<size_t>(candidate.frame + 1, frames_ - 2);
  const auto parting = [&](size_t interval) {
    return normal.dot(a.MeanVelocity(interval, candidate.arm_a) -
                      b.MeanVelocity(interval, candidate.arm_b));
  };
  const double falls = (a.balanced() ? 1 : 0) - (b.balanced() ? 1 : 0);
  const double in_flight = falls * normal.dot(motion_.gravity_m_per_s2) * motion_.frame_s *
                           static_cast<double>(last - first);
  const double before = parting(first);
  return before > 0 && parting(last) < before + in_flight - kStillSpeed;
}

void ContactSearch::AddLoads(size_t p, const std::vector<PairFrame>& frames,
                             std::vector<Candidate>& out) const {
  const BodyPair& pair = pairs_[p];
  const size_t body = bodies_.motions[pair.a].balanced() ? pair.a : pair.b;
  for (size_t k = 1; k + 1 < frames_; ++k) {
    if (!acts_[pair.a][k] || !acts_[pair.b][k]) continue;
    size_t last = k;
    while (frames[k].still && last + 2 < frames_ && frames[last + 1].still &&
           skipped_[body][last + 1]) {
      ++last;
    }
    for (const ContactFeature& feature : frames[k].features) {
      Candidate candidate{.pair = static_cast<uint32_t>(p),
                          .frame = static_cast<uint32_t>(k),
                          .last_frame = static_cast<uint32_t>(last),
                          .feature = feature,
                          .slack_m = frames[k].slack_m};
      candidate.feature.gap_m -= pair.offset_m;
      Add(candidate, 0, Path::kBetween, out);
    }
    k = last;
  }
}

void ContactSearch::AddBlows(size_t p, const std::vector<PairFrame>& frames, bool known,
                             std::vector<Candidate>& out) const {
  const BodyPair& pair = pairs_[p];
  const double tolerance = pair.tolerance_m, bin_s = motion_.frame_s / bin_count_;
  for (size_t k = 0; k + 1 < frames_; ++k) {
    if (!(acts_[pair.a][k] || acts_[pair.a][k + 1]) || !(acts_[pair.b][k] || acts_[pair.b][k + 1]))
      continue;
    if (frames[k].still && frames[k + 1].still) continue;
    const double slack = Slack(pair, k), reach = slack + 4 * tolerance;
    if (!Near(pair, k, reach + slack * bin_count_)) continue;
    for (int bin = 0; bin < bin_count_; ++bin) {
      std::map<uint64_t, std::pair<Candidate, Path>> best;
      for (const Path path : {Path::kBefore, Path::kBetween, Path::kAfter, Path::kKnown}) {
        if (known != (path == Path::kKnown)) continue;
        for (const ContactFeature& feature :
             Features(pair, Place(pair, k, bin * bin_s, path), reach)) {
          Candidate candidate{.pair = static_cast<uint32_t>(p),
                              .frame = static_cast<uint32_t>(k),
                              .last_frame = static_cast<uint32_t>(k),
                              .bin = bin,
                              .feature = feature,
                              .slack_m = slack};
          candidate.feature.gap_m -= pair.offset_m;
          const auto at = best.try_emplace(feature.key, candidate, path).first;
          if (std::abs(candidate.feature.gap_m) < std::abs(at->second.first.feature.gap_m)) {
            at->second = {candidate, path};
          }
        }
      }
      for (const auto& [key, found] : best) Add(found.first, bin * bin_s, found.second, out);
    }
  }
}

std::vector<Candidate> ContactSearch::Find(bool known) {
  std::vector<std::vector<PairFrame>> frames(pairs_.size());
  InParallel(pairs_.size(), [&](size_t p) {
    FindAtFrames(p, frames[p]);
    FindOffset(pairs_[p], frames[p]);
  });
  MarkPiles(frames);
  std::vector<std::vector<Candidate>> of_pair(pairs_.size());
  InParallel(pairs_.size(), [&](size_t p) {
    AddLoads(p, frames[p], of_pair[p]);
    AddBlows(p, frames[p], known, of_pair[p]);
  });
  std::vector<Candidate> candidates;
  for (const std::vector<Candidate>& some : of_pair) {
    candidates.insert(candidates.end(), some.begin(), some.end());
  }
  return candidates;
}

}  // namespace carillon::motion
