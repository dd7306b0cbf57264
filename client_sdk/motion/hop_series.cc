// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/hop_series.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

namespace carillon::motion {
namespace {

using Index = Eigen::Index;

/// Heights are known within this part of the distance of the plane from the centre of mass.
constexpr double kTolerance = 0.01;
/// The steps of a simulator move the ends of a hop, so that heights are less well known by these
/// parts of the height of the hop and of the way that the body takes in a frame.
constexpr double kPartOfHeight = 0.02, kPartOfFrame = 0.02;
/// A body rests that would hop no higher than this part of the tolerance.
constexpr double kLeastHeight = 0.15;
/// Heights at frames may differ from those of a series by this part of the tolerance.
constexpr double kMostOff = 0.5;
/// Heights, and coefficients of restitution after each other, usually differ by so much.
constexpr double kUsuallyOff = 0.1, kUneven = 0.05;
/// A coefficient of restitution that nothing else tells stands for the fewest hops.
constexpr double kCostOfHop = 0.01;
/// The steps in which coefficients of restitution are looked at, at first and at last.
constexpr double kCoarse = 0.005, kFine = 1e-6;
/// The number of frames that tell a flight, and a rest.
constexpr size_t kFlightFrames = 2, kRestFrames = 4;
/// The momenta tell two hops apart that lie this number of frames apart.
constexpr double kAloneFrames = 2.5;
/// A change of an impulse costs this share of the energy that it would explain.
constexpr double kKeep = 0.01;

/// When a body lands, since the first frame, and how fast along the normal.
struct Landing {
  double time_s = 0, speed_m_per_s = 0;
};

/// A landing after which the body leaves the plane with a share of its speed.
struct Hop : Landing {
  double restitution = 0;
};

/// How a body may go on after a landing, up to the first flight or rest with a frame in it.
struct Course {
  std::vector<Hop> hops;
  Landing next;
  bool rests = false;
  double off = 0;  ///< the most by which the heights at frames differ from it, in tolerances
  double cost = 0;
};

/// Hops after each other, and until when they stand for all blows of the pair, s.
struct Run {
  std::vector<Hop> hops;
  double end_s = 0;
};

/// A body above a plane of a fixed body.
class Hopper {
 public:
  /// The plane is that of a blow.
  Hopper(const Motion& motion, const SearchBodies& bodies, const BodyPair& pair,
         const FoundBlow& blow)
      : motion_(motion),
        bodies_(bodies),
        pair_(pair),
        is_a_(bodies.motions[pair.a].balanced()),
        body_(is_a_ ? pair.a : pair.b),
        normal_(is_a_ ? blow.normal : Vector(-blow.normal)),
        gravity_(-normal_.dot(motion.gravity_m_per_s2)),
        tolerance_m_(kTolerance * Support(moves().AtFrame(blow.frame).orientation)),
        least_m_per_s_(std::sqrt(2 * std::max(0.0, gravity_) * kLeastHeight * tolerance_m_)),
        places_(motion.frame_count()) {
    const BodyMotion& fixed = bodies.motions[is_a_ ? pair.b : pair.a];
    const Vector& point_m = is_a_ ? blow.point_b_m : blow.point_a_m;
    const BodyPose pose = fixed.AtFrame(0);
    plane_m_ = normal_.dot(pose.position_m + pose.orientation * (point_m - fixed.centre_m()));
  }

  bool falls_on_plane() const { return gravity_ > 0; }
  const BodyMotion& moves() const { return bodies_.motions[body_]; }
  uint32_t body() const { return body_; }
  const Vector& normal() const { return normal_; }

  /// Returns the pose that the body has when it touches the plane at a time.
  BodyPose Landed(size_t interval, double time_s) const {
    BodyPose pose = moves().At(interval, time_s, Path::kBetween);
    pose.position_m +=
        (plane_m_ + Support(pose.orientation) - normal_.dot(pose.position_m)) * normal_;
    return pose;
  }

  /// Returns the hops after the first flight that goes on at one of these frames.
  Run HopsAfterFlight(size_t first_frame, size_t last_frame) {
    Run run;
    size_t frame = first_frame;
    while (frame <= last_frame && !Flies(frame)) ++frame;
    if (frame > last_frame) return run;
    while (Flies(frame)) ++frame;
    std::optional<Landing> landing = LandingAfter(frame);
    std::optional<double> restitution;
    while (landing) {
      const std::optional<Course> course = Best(*landing, restitution);
      if (!course) break;
      run.hops.insert(run.hops.end(), course->hops.begin(), course->hops.end());
      const Hop& last = run.hops.back();
      run.end_s = course->rests ? last.time_s + (kRestFrames - 1) * motion_.frame_s
                                : (last.time_s + course->next.time_s) / 2;
      if (course->rests) break;
      restitution = last.restitution;
      landing = course->next;
      // The last frames of a long flight tell its end best.
      const size_t end = std::min(FrameAfter(landing->time_s), places_.size()) - 1;
      if (end > FrameAfter(last.time_s) + 1) landing = LandingAfter(end);
    }
    return run;
  }

 private:
  /// How high a body is in a frame, and how far it reaches down.
  struct Place {
    double height_m = 0, support_m = 0;
  };

  double TimeOf(size_t frame) const { return static_cast<double>(frame) * motion_.frame_s; }
  size_t FrameAfter(double time_s) const {
    return static_cast<size_t>(std::floor(time_s / motion_.frame_s + 1e-9)) + 1;
  }

  const Place& At(size_t frame) {
    std::optional<Place>& place = places_[frame];
    if (!place) {
      const BodyPose pose = moves().AtFrame(frame);
      const double support_m = Support(pose.orientation);
      place = {normal_.dot(pose.position_m) - plane_m_ - support_m, support_m};
    }
    return *place;
  }

  /// How far the centre of mass is above the plane when the body rests on it.
  double Support(const Turn& orientation) const {
    const Vector down = orientation.conjugate() * -normal_;
    double most = 0;
    for (const Vector& corner : bodies_.surfaces[body_]->corners()) {
      most = std::max(most, down.dot(corner - moves().centre_m()));
    }
    // A ball is rounder than its mesh.
    const double radius_m = moves().radius_m() - motion_.bodies[body_].rounding_m;
    if (most > (1 - kTolerance) * radius_m) most = radius_m;
    return most + pair_.rounding_m + pair_.offset_m;
  }

  bool Flies(size_t node) {
    return node > 0 && node + 1 < places_.size() &&
           moves().Jump(node) < bodies_.free_speed[body_] && IsLevel(node);
  }
  /// True if the body has not tipped since the frame before.
  bool IsLevel(size_t frame) {
    return std::abs(At(frame).support_m - At(frame - 1).support_m) < kMostOff * tolerance_m_;
  }

  /// When and how fast a body lands that flies in a frame and in the one before.
  std::optional<Landing> LandingAfter(size_t frame) {
    const double h = motion_.frame_s, height_m = At(frame).height_m;
    const double up = (height_m - At(frame - 1).height_m) / h - gravity_ * h / 2;
    const double square = up * up + 2 * gravity_ * height_m;
    if (square < least_m_per_s_ * least_m_per_s_) return std::nullopt;
    const double lands_s = (up + std::sqrt(square)) / gravity_;
    if (lands_s < -0.5 * h || lands_s > 1.5 * h) return std::nullopt;
    return Landing{TimeOf(frame) + lands_s, std::sqrt(square)};
  }

  Course Follow(Landing from, double restitution, std::optional<double> before) {
    Course course;
    const size_t frame = FrameAfter(from.time_s);
    double lasts_s = 0;
    for (;;) {
      course.hops.push_back({from, restitution});
      course.next.speed_m_per_s = restitution * from.speed_m_per_s;
      lasts_s = 2 * course.next.speed_m_per_s / gravity_;
      course.next.time_s = from.time_s + lasts_s;
      course.rests = course.next.speed_m_per_s < least_m_per_s_;
      if (course.rests || course.next.time_s > TimeOf(frame)) break;
      from = course.next;
    }
    const double up = course.next.speed_m_per_s;
    const size_t end = frame + (course.rests ? kRestFrames : kFlightFrames);
    double sum = 0, count = 0;
    for (size_t k = frame; k < std::min(end, places_.size()); ++k) {
      const double since_s = TimeOf(k) - from.time_s;
      const bool flies = since_s < lasts_s;
      if (!flies && !course.rests) break;
      const double height_m = flies ? up * since_s - gravity_ * since_s * since_s / 2 : 0;
      const double rate = flies ? std::abs(up - gravity_ * since_s) : 0;
      const double known_m = tolerance_m_ + kPartOfHeight * up * up / (2 * gravity_) +
                             kPartOfFrame * motion_.frame_s * rate;
      const double off = std::abs(At(k).height_m - height_m) / known_m;
      course.off = std::max(course.off, IsLevel(k) ? off : 1e300);
      sum += off * off;
      ++count;
    }
    const double uneven = before ? (restitution - *before) / kUneven : 0;
    course.cost = sum / count / (kUsuallyOff * kUsuallyOff) + uneven * uneven +
                  kCostOfHop * static_cast<double>(course.hops.size());
    return course;
  }

  /// Returns the best course after a landing, if one agrees with the heights at frames.
  std::optional<Course> Best(const Landing& landing, std::optional<double> before) {
    if (FrameAfter(landing.time_s) + 1 >= places_.size()) return std::nullopt;
    double at = 0;
    Course best = Follow(landing, at, before);
    const auto look = [&](double restitution) {
      Course course = Follow(landing, restitution, before);
      if (course.cost >= best.cost) return;
      best = std::move(course);
      at = restitution;
    };
    for (double e = kCoarse; e <= 1; e += kCoarse) look(e);
    for (double step = kCoarse / 2; step > kFine; step /= 2) {
      const double middle = at;
      look(middle - step);
      look(middle + step);
    }
    if (best.off > kMostOff) return std::nullopt;
    return best;
  }

  const Motion& motion_;
  const SearchBodies& bodies_;
  const BodyPair& pair_;
  bool is_a_;
  uint32_t body_;
  Vector normal_;   ///< towards the body
  double gravity_;  ///< against the normal, m/s^2
  double tolerance_m_;
  double least_m_per_s_;  ///< with which the body leaves the plane if it does not rest
  double plane_m_ = 0;
  std::vector<std::optional<Place>> places_;  ///< at each frame that was looked at
};

/// Makes blows of the hops of a body.
class BlowMaker {
 public:
  BlowMaker(const Motion& motion, const ContactSearch& search, const BodyPair& pair,
            const Hopper& hopper)
      : motion_(motion),
        search_(search),
        pair_(pair),
        hopper_(hopper),
        moves_(hopper.moves()),
        sign_(hopper.body() == pair.a ? 1 : -1) {}

  void Add(const Hop& hop) {
    FoundBlow blow;
    blow.a = pair_.a;
    blow.b = pair_.b;
    blow.balanced_s = hop.time_s;
    std::tie(blow.frame, blow.time_s) = FrameAt(hop.time_s, motion_.frame_s, motion_.frame_count());
    blow.normal = sign_ * hopper_.normal();
    blow.approach_m_per_s = hop.speed_m_per_s;
    const BodyPose pose = hopper_.Landed(blow.frame, blow.time_s);
    const std::vector<ContactFeature> features = Features(blow, pose);
    const double whole = moves_.mass_kg() * (1 + hop.restitution) * hop.speed_m_per_s;
    blow.impulse_newton_seconds = whole / static_cast<double>(features.size()) * blow.normal;
    for (const ContactFeature& feature : features) {
      blow.point_a_m = feature.point_a;
      blow.point_b_m = feature.point_b;
      blows_.push_back(blow);
      const Vector& point_m = sign_ > 0 ? feature.point_a : feature.point_b;
      arms_.push_back(pose.orientation * (point_m - moves_.centre_m()));
    }
  }

  /// Gives the blows the friction, and divides them among the corners of a face, as the momenta
  /// along the plane and the angular momenta demand.
  std::vector<FoundBlow> Take() {
    if (blows_.empty()) return {};
    const Eigen::VectorXd impulses = Balanced();
    for (size_t first = 0, end = 0; first < blows_.size(); first = end) {
      double whole = 0, pressed = 0;
      for (; end < blows_.size() && blows_[end].balanced_s == blows_[first].balanced_s; ++end) {
        FoundBlow& blow = blows_[end];
        whole += blow.impulse_newton_seconds.norm();
        blow.impulse_newton_seconds =
            InCone(impulses.segment<3>(static_cast<Index>(3 * end)), blow.normal);
        pressed += blow.normal.dot(blow.impulse_newton_seconds);
      }
      for (size_t i = first; i < end; ++i) {
        blows_[i].impulse_newton_seconds *= whole / std::max(pressed, 1e-300);
        blows_[i].balanced_newton_seconds = blows_[i].impulse_newton_seconds;
      }
    }
    return std::move(blows_);
  }

 private:
  /// Where the body touches the plane in a pose.
  std::vector<ContactFeature> Features(const FoundBlow& blow, const BodyPose& pose) const {
    PairPlacement at = search_.Place(pair_, blow.frame, blow.time_s, Path::kBetween);
    (sign_ > 0 ? at.a : at.b).position_m = pose.position_m - pose.orientation * moves_.centre_m();
    std::vector<ContactFeature> features =
        search_.Features(pair_, at, pair_.tolerance_m + std::abs(pair_.offset_m));
    double nearest_m = 1e300;
    for (const ContactFeature& feature : features) {
      nearest_m = std::min(nearest_m, feature.gap_m);
    }
    std::erase_if(features, [&](const ContactFeature& feature) {
      return feature.normal.dot(blow.normal) < 0.9 ||
             (feature.round && feature.gap_m > nearest_m + kUsuallyOff * pair_.tolerance_m);
    });
    return features;
  }

  /// Returns the impulses that balance the momenta, but for that along the normal, and differ least
  /// from those of the blows.
  Eigen::VectorXd Balanced() const {
    const size_t first = std::max<size_t>(1, blows_.front().frame);
    const size_t last = std::min(blows_.back().frame + 1, motion_.frame_count() - 2);
    const auto rows = static_cast<Index>(6 * (last + 1 - first));
    const auto columns = static_cast<Index>(3 * blows_.size());
    const double root_mass = std::sqrt(moves_.mass_kg());
    const Matrix along = Matrix::Identity() - hopper_.normal() * hopper_.normal().transpose();
    Eigen::MatrixXd acts = Eigen::MatrixXd::Zero(rows, columns);
    Eigen::VectorXd given(rows), impulses(columns), sizes(columns);
    for (size_t i = 0; i < blows_.size(); ++i) {
      const Vector& impulse = blows_[i].impulse_newton_seconds;
      impulses.segment<3>(static_cast<Index>(3 * i)) = impulse;
      sizes.segment<3>(static_cast<Index>(3 * i)).setConstant(impulse.norm());
    }
    for (size_t k = first; k <= last; ++k) {
      const auto row = static_cast<Index>(6 * (k - first));
      const Matrix root = moves_.InverseInertia(k).llt().matrixU();
      given.segment<3>(row) = along * moves_.Impulse(k) / root_mass;
      given.segment<3>(row + 3) = root * moves_.Torque(k);
      for (size_t i = 0; i < blows_.size(); ++i) {
        const double share = blows_[i].time_s / motion_.frame_s;
        const double part = blows_[i].frame == k ? 1 - share : blows_[i].frame + 1 == k ? share : 0;
        const auto column = static_cast<Index>(3 * i);
        acts.block<3, 3>(row, column) = sign_ * part / root_mass * along;
        for (Index axis = 0; axis < 3; ++axis) {
          acts.block<3, 1>(row + 3, column + axis) =
              sign_ * part * root * arms_[i].cross(Vector::Unit(axis));
        }
      }
    }
    const Eigen::MatrixXd pulls = (sizes / sizes.maxCoeff()).asDiagonal() * acts.transpose();
    Eigen::MatrixXd energy = acts * pulls;
    energy.diagonal().array() += kKeep / moves_.mass_kg();
    return impulses + pulls * energy.ldlt().solve(given - acts * impulses);
  }

  /// Brings an impulse into the cone of friction about a normal.
  Vector InCone(const Vector& impulse, const Vector& normal) const {
    const double pressed = std::max(0.0, normal.dot(impulse));
    Vector friction = impulse - normal.dot(impulse) * normal;
    const double most = pair_.friction * pressed;
    if (friction.norm() > most) friction *= most / friction.norm();
    return pressed * normal + friction;
  }

  const Motion& motion_;
  const ContactSearch& search_;
  const BodyPair& pair_;
  const Hopper& hopper_;
  const BodyMotion& moves_;
  double sign_;                   ///< of the body's impulse
  std::vector<FoundBlow> blows_;  ///< the corners of a hop after each other
  std::vector<Vector> arms_;      ///< of the blows, from the centre of mass, in the scene's axes
};

/// True if a body touches another one than that of a pair between two times.
bool TouchesOthers(const FoundContacts& found, uint32_t body, const BodyPair& pair, double frame_s,
                   double from_s, double to_s) {
  const auto is_other = [&](const ContactPoint& contact, double time_s) {
    return (contact.a == body || contact.b == body) &&
           (contact.a != pair.a || contact.b != pair.b) && time_s > from_s && time_s < to_s;
  };
  return std::ranges::any_of(
             found.blows,
             [&](const FoundBlow& blow) { return is_other(blow, blow.SinceFirst(frame_s)); }) ||
         std::ranges::any_of(found.loads, [&](const FoundLoad& load) {
           return is_other(load, static_cast<double>(load.frame) * frame_s);
         });
}

}  // namespace

std::vector<HopSeries> FindHops(const Motion& motion, const SearchBodies& bodies,
                                const ContactSearch& search, const FoundContacts& found) {
  std::vector<HopSeries> series;
  const double h = motion.frame_s;
  for (uint32_t p = 0; p < search.pairs().size() && !motion.frames_are_steps; ++p) {
    const BodyPair& pair = search.pairs()[p];
    if (bodies.motions[pair.a].balanced() == bodies.motions[pair.b].balanced()) continue;
    const uint32_t other = bodies.motions[pair.a].balanced() ? pair.b : pair.a;
    if (motion.bodies[other].poses.size() > 1) continue;
    double done_s = 0;
    for (const FoundBlow& blow : found.blows) {
      if (blow.a != pair.a || blow.b != pair.b || blow.SinceFirst(h) < done_s) continue;
      Hopper hopper(motion, bodies, pair, blow);
      if (!hopper.falls_on_plane()) continue;
      // The time of a blow may be up to a frame late if several are found as one.
      Run run = hopper.HopsAfterFlight(std::max<size_t>(blow.frame, 2) - 2, blow.frame + 1);
      std::vector<Hop>& hops = run.hops;
      if (hops.empty() || hops.front().time_s < done_s) continue;
      done_s = run.end_s;
      const auto follow_within = [&hops](double time_s) {
        return std::ranges::adjacent_find(hops, [time_s](const Hop& one, const Hop& next) {
          return next.time_s - one.time_s < time_s;
        });
      };
      if (follow_within(h) == hops.end()) continue;
      // Hops that are not much slower may be found wrongly, too, for the sake of the faster ones.
      hops.erase(hops.begin(), follow_within(kAloneFrames * h));
      const double first_s = hops.front().time_s - h;
      const double last_s = std::min(run.end_s, hops.back().time_s + h);
      if (TouchesOthers(found, hopper.body(), pair, h, first_s, last_s)) continue;
      BlowMaker maker(motion, search, pair, hopper);
      for (const Hop& hop : hops) maker.Add(hop);
      series.push_back({p, first_s, run.end_s, maker.Take()});
    }
  }
  return series;
}

void RemoveHops(const Motion& motion, int bin_count, const std::vector<HopSeries>& series,
                std::vector<Candidate>& candidates) {
  std::erase_if(candidates, [&](const Candidate& candidate) {
    const double share = static_cast<double>(candidate.bin) / bin_count;
    const double time_s = (candidate.frame + share) * motion.frame_s;
    return candidate.blow() && std::ranges::any_of(series, [&](const HopSeries& of) {
             return of.pair == candidate.pair && time_s > of.first_s && time_s < of.last_s;
           });
  });
}

}  // namespace carillon::motion
