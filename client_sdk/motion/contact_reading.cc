// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/contact_reading.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace carillon::motion {
namespace {

/// A blow has more than this share of the impulse that the load around it gives in a frame,
constexpr double kShareOfLoad = 0.2;
/// and changes the relative velocity of the bodies by at least this, m/s.
constexpr double kLeastSpeed = 0.02;
/// Blows that lie closer than this part of a frame strike together.
constexpr double kTogether = 0.02;
/// The speed of approach is at least half of the change that the impulse makes, in an elastic
/// collision. One below this share of the change is not that of the blow, but of one beside it.
constexpr double kLeastOfSpeed = 0.3;
/// Impulses that can be divided more evenly by less than this part stay as they are.
constexpr double kLeastEven = 0.05;

/// An impulse at a point, at a time since the first frame.
struct Piece {
  const Candidate* candidate = nullptr;
  double time_s = 0;
  Vector impulse = Vector::Zero();
};

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// The contacts of one pair while they are divided into blows and loads.
class PairReading {
 public:
  PairReading(const Motion& motion, const SearchBodies& bodies, const BodyPair& pair, double bin_s)
      : motion_(motion),
        bin_s_(bin_s),
        bodies_(bodies),
        pair_(pair),
        forces_(motion.frame_count(), 0.0) {}

  void Add(const Candidate& candidate, double time_s, const Vector& value) {
    if (candidate.blow()) {
      pieces_.push_back({&candidate, time_s, value});
      return;
    }
    for (size_t k = candidate.frame; k <= candidate.last_frame; ++k) {
      loads_.push_back({k, {&candidate, 0, value}});
      forces_[k] += value.norm();
    }
  }

  void Read(FoundContacts& found) {
    std::ranges::stable_sort(pieces_, {}, &Piece::time_s);
    ReadBlows();
    ReadLeaps();
    JoinPlaces();
    for (const std::vector<Piece>& blow : blows_) AddBlow(blow, found);
    for (const auto& [frame, piece] : loads_) AddLoad(frame, piece, found);
  }

 private:
  /// The median of the load in the frames around, N.
  double Around(size_t frame, size_t without) const {
    std::vector<double> near;
    const size_t last = forces_.size() - 1;
    for (size_t k = frame > 3 ? frame - 3 : 0; k <= std::min(frame + 3, last); ++k) {
      if (k + without > frame && k < frame + without) continue;
      near.push_back(forces_[k]);
    }
    return Median(near);
  }
  double Least(size_t frame, size_t without) const {
    return kShareOfLoad * motion_.frame_s * Around(frame, without) +
           kLeastSpeed * pair_.reduced_mass_kg;
  }

  /// The impulse that the load at a time lacks of the load around it in the time of a frame, N s.
  double Lacking(double time_s) const {
    double lacking = 0;
    for (size_t k = 0; k < forces_.size(); ++k) {
      const double weight = 1 - std::abs(static_cast<double>(k) - time_s / motion_.frame_s);
      if (weight > 0) lacking += weight * std::max(0.0, Around(k, 0) - forces_[k]);
    }
    return lacking * motion_.frame_s;
  }

  /// Takes pieces of one frame's time together, and keeps as loads those that are small, or that
  /// stand for a load which is not there.
  void ReadBlows() {
    for (size_t first = 0; first < pieces_.size();) {
      size_t end = first;
      double sum = 0;
      while (end < pieces_.size() &&
             pieces_[end].time_s - pieces_[first].time_s < motion_.frame_s * 1.0001) {
        sum += pieces_[end++].impulse.norm();
      }
      const std::vector<Piece> blow(pieces_.begin() + static_cast<std::ptrdiff_t>(first),
                                    pieces_.begin() + static_cast<std::ptrdiff_t>(end));
      if (sum - Lacking(MeanTime(blow)) > Least(blow.front().candidate->frame, 0)) {
        blows_.push_back(blow);
      } else {
        for (const Piece& piece : blow) {
          const auto frame = static_cast<size_t>(std::lround(piece.time_s / motion_.frame_s));
          loads_.push_back({frame, {piece.candidate, 0, piece.impulse / motion_.frame_s}});
        }
      }
      first = end;
    }
  }

  /// Moves the part of a load that is above the usual load, in one frame or two, into a blow. A
  /// blow that was found at the places and within the time of the load takes this part.
  void ReadLeaps() {
    const std::vector<double> forces = forces_;
    std::vector<double> kept(forces.size(), 1);
    for (size_t k = 1; k + 1 < forces.size(); ++k) {
      const double usual = Around(k, 2), excess = (forces[k] - usual) * motion_.frame_s;
      if (forces[k] == 0 || excess < Least(k, 2)) continue;
      kept[k] = usual / forces[k];
    }
    for (size_t k = 1; k + 1 < forces.size(); ++k) {
      if (kept[k] == 1) continue;
      size_t end = k;
      while (end < kept.size() && kept[end] < 1) ++end;
      std::vector<Piece> blow;
      for (auto& [frame, piece] : loads_) {
        if (frame < k || frame >= end || end > k + 2) continue;
        blow.push_back({piece.candidate, static_cast<double>(frame) * motion_.frame_s,
                        piece.impulse * (1 - kept[frame]) * motion_.frame_s});
        piece.impulse *= kept[frame];
      }
      if (!blow.empty()) Join(static_cast<double>(k - 1), static_cast<double>(end), blow);
      k = end;
    }
  }

  /// Adds the pieces of loads to the blow at their places between two frames or, if there is none,
  /// as a blow.
  void Join(double first_frame, double last_frame, std::vector<Piece>& pieces) {
    for (std::vector<Piece>& blow : blows_) {
      const auto is_of_blow = [&](const Piece& piece) {
        return std::ranges::any_of(blow, [&](const Piece& of) { return AtOnePlace(of, piece); });
      };
      const double time_s = MeanTime(blow), frame = time_s / motion_.frame_s;
      if (frame <= first_frame || frame >= last_frame) continue;
      if (!std::ranges::all_of(pieces, is_of_blow)) continue;
      for (Piece& piece : pieces) piece.time_s = time_s;
      blow.insert(blow.end(), pieces.begin(), pieces.end());
      return;
    }
    blows_.push_back(std::move(pieces));
  }

  /// Moves pieces to the blow before, if it has their place less than a frame earlier.
  void JoinPlaces() {
    std::ranges::stable_sort(blows_, {}, MeanTime);
    for (size_t i = 1; i < blows_.size(); ++i) {
      std::vector<Piece>& before = blows_[i - 1];
      const std::vector<Piece> places = before;
      std::erase_if(blows_[i], [&](const Piece& piece) {
        const auto is_it = [&](const Piece& place) {
          return AtOnePlace(place, piece) &&
                 std::abs(piece.time_s - place.time_s) < 0.99 * motion_.frame_s;
        };
        if (!std::ranges::any_of(places, is_it)) return false;
        before.push_back(piece);
        return true;
      });
    }
    std::erase_if(blows_, [](const std::vector<Piece>& blow) { return blow.empty(); });
  }

  bool AtOnePlace(const Piece& one, const Piece& other) const {
    const ContactFeature &a = one.candidate->feature, &b = other.candidate->feature;
    return a.key == b.key || (a.point_a - b.point_a).norm() < 3 * pair_.tolerance_m;
  }

  /// Adds a blow for each place: pieces at neighbouring places are one.
  void AddBlow(const std::vector<Piece>& pieces, FoundContacts& found) {
    std::vector<std::vector<Piece>> places;
    for (const Piece& piece : pieces) {
      const auto near = [&](const std::vector<Piece>& place) {
        return AtOnePlace(place.front(), piece);
      };
      const auto place = std::ranges::find_if(places, near);
      if (place == places.end())
        places.push_back({piece});
      else
        place->push_back(piece);
    }
    // Places that cannot be told apart in time have one time.
    const auto [first, last] = std::ranges::minmax(pieces, {}, &Piece::time_s);
    const bool at_once = last.time_s - first.time_s < kBinsAtOnce * bin_s_;
    const std::vector<Vector> impulses = Impulses(places, at_once);
    for (size_t i = 0; i < places.size(); ++i) {
      AddPlace(places[i], impulses[i], MeanTime(at_once ? pieces : places[i]), found);
    }
  }

  /// Returns the impulse of each place. Impulses that act at once are divided as evenly as their
  /// sum, their torque and friction allow: the balance leaves it open how the corners of a face
  /// share a blow, and pushes the corners apart.
  std::vector<Vector> Impulses(const std::vector<std::vector<Piece>>& places, bool at_once) const {
    const bool of_a = bodies_.motions[pair_.a].balanced();
    Eigen::Matrix<double, 6, 6> sums = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> whole = Eigen::Matrix<double, 6, 1>::Zero();
    std::vector<std::pair<Vector, Vector>> given;  // the impulse and the arm of each place
    for (const std::vector<Piece>& place : places) {
      Vector impulse = Vector::Zero(), arm = Vector::Zero();
      double size = 0;
      for (const Piece& piece : place) {
        const double own = piece.impulse.norm();
        impulse += piece.impulse;
        arm += own * (of_a ? piece.candidate->arm_a : piece.candidate->arm_b);
        size += own;
      }
      arm /= std::max(size, 1e-300);
      Eigen::Matrix<double, 6, 3> acts;
      acts << Matrix::Identity(), Cross(arm);
      sums += acts * acts.transpose();
      whole += acts * impulse;
      given.emplace_back(impulse, arm);
    }
    const Eigen::Matrix<double, 6, 1> even = sums.completeOrthogonalDecomposition().solve(whole);
    const auto share = [&](size_t place, double part) {
      const auto& [impulse, arm] = given[place];
      const Vector least = even.head<3>() - arm.cross(Vector(even.tail<3>()));
      return Vector(impulse + part * (least - impulse));
    };
    const auto shares = [&](double part) {
      std::vector<Vector> impulses;
      for (size_t i = 0; i < places.size(); ++i) impulses.push_back(share(i, part));
      return impulses;
    };
    if (!at_once) return shares(0);
    const auto may_be = [&](double part) {
      for (size_t i = 0; i < places.size(); ++i) {
        Vector normal = places[i].front().candidate->feature.normal;
        if (normal.dot(given[i].first) < 0) normal = -normal;
        const Vector impulse = share(i, part);
        const double pressed = impulse.dot(normal);
        if (pressed <= 0 || (impulse - pressed * normal).norm() > pair_.friction * pressed) {
          return false;
        }
      }
      return true;
    };
    double part = 1;
    while (part > kLeastEven && !may_be(part)) part *= 0.8;
    return shares(part > kLeastEven ? part : 0);
  }

  /// The matrix that multiplies a vector by an arm from the left.
  static Matrix Cross(const Vector& arm) {
    Matrix cross;
    cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    return cross;
  }

  /// The time of pieces, weighted by their impulses, s.
  static double MeanTime(const std::vector<Piece>& pieces) {
    double sum = 0, moment = 0;
    for (const Piece& piece : pieces) {
      sum += piece.impulse.norm();
      moment += piece.impulse.norm() * piece.time_s;
    }
    return sum > 0 ? moment / sum : pieces.front().time_s;
  }

  void AddPlace(const std::vector<Piece>& pieces, const Vector& impulse, double time_s,
                FoundContacts& found) {
    FoundBlow blow;
    blow.a = pair_.a;
    blow.b = pair_.b;
    double sum = 0;
    for (const Piece& piece : pieces) {
      const double size = piece.impulse.norm();
      sum += size;
      blow.point_a_m += size * piece.candidate->feature.point_a;
      blow.point_b_m += size * piece.candidate->feature.point_b;
      blow.balanced_newton_seconds += piece.impulse;
    }
    if (sum == 0) return;
    blow.balanced_s = MeanTime(pieces);
    blow.impulse_newton_seconds = impulse;
    blow.point_a_m /= sum;
    blow.point_b_m /= sum;
    std::tie(blow.frame, blow.time_s) = FrameAt(time_s, motion_.frame_s, forces_.size());
    blow.normal = pieces.front().candidate->feature.normal;
    if (blow.normal.dot(impulse) < 0) blow.normal = -blow.normal;
    found.blows.push_back(blow);
  }

  void AddLoad(size_t frame, const Piece& piece, FoundContacts& found) const {
    if (piece.impulse.isZero(0)) return;
    FoundLoad load;
    load.a = pair_.a;
    load.b = pair_.b;
    load.frame = frame;
    load.point_a_m = piece.candidate->feature.point_a;
    load.point_b_m = piece.candidate->feature.point_b;
    load.force_newtons = piece.impulse;
    const Vector slip = bodies_.motions[pair_.a].VelocityAt(frame, piece.candidate->arm_a) -
                        bodies_.motions[pair_.b].VelocityAt(frame, piece.candidate->arm_b);
    const Vector& normal = piece.candidate->feature.normal;
    load.slip_m_per_s = (slip - slip.dot(normal) * normal).norm();
    found.loads.push_back(load);
  }

  const Motion& motion_;
  double bin_s_;
  const SearchBodies& bodies_;
  const BodyPair& pair_;
  std::vector<Piece> pieces_;
  std::vector<std::vector<Piece>> blows_;        ///< pieces of one frame's time together
  std::vector<std::pair<size_t, Piece>> loads_;  ///< with forces instead of impulses
  std::vector<double> forces_;                   ///< the sum of the loads at each frame
};

Confidence ReadConfidence(const Motion& motion, const SearchBodies& bodies,
                          const ContactProblem& problem) {
  // In free flight there is no momentum to explain, but the rounding of the poses.
  const double free_speed = 0.1 * motion.gravity_m_per_s2.norm() * motion.frame_s;
  const size_t frames = motion.frame_count();
  Confidence confidence;
  double given = 0, residual = 0, worst = 0;
  for (size_t body = 0; body < bodies.motions.size(); ++body) {
    double own_given = 0, own_residual = 0;
    for (size_t k = 1; k + 1 < frames; ++k) {
      own_given += problem.balance().Given(body, k);
      const double here = problem.balance().Residual(body, k);
      own_residual += here;
      if (here <= worst) continue;
      worst = here;
      confidence.worst_body = body;
      confidence.worst_frame = k;
    }
    const double weighed =
        static_cast<double>(frames) * bodies.motions[body].mass_kg() * free_speed * free_speed;
    own_given = std::max(own_given, weighed);
    given += own_given;
    residual += own_residual;
    confidence.unexplained_of_body.push_back(own_given > 0 ? own_residual / own_given : 0);
  }
  confidence.unexplained = given > 0 ? residual / given : 0;
  return confidence;
}

}  // namespace

FoundContacts ReadContacts(const Motion& motion, const SearchBodies& bodies,
                           const ContactSearch& search, const ContactProblem& problem,
                           const std::vector<HopSeries>& series) {
  FoundContacts found;
  std::vector<PairReading> readings;
  const double bin_s = motion.frame_s / search.bin_count();
  for (const BodyPair& pair : search.pairs()) readings.emplace_back(motion, bodies, pair, bin_s);
  for (size_t i = 0; i < problem.candidates().size(); ++i) {
    const Candidate& candidate = problem.candidates()[i];
    if (problem.value(i).isZero(0)) continue;
    readings[candidate.pair].Add(candidate, problem.TimeOf(candidate), problem.value(i));
  }
  for (PairReading& reading : readings) reading.Read(found);
  for (const HopSeries& of : series) {
    found.blows.insert(found.blows.end(), of.blows.begin(), of.blows.end());
  }
  const auto time = [&](const FoundBlow& blow) {
    return static_cast<double>(blow.frame) * motion.frame_s + blow.time_s;
  };
  std::ranges::stable_sort(found.blows, {}, time);
  std::ranges::stable_sort(found.loads, {}, &FoundLoad::frame);
  found.confidence = ReadConfidence(motion, bodies, problem);
  return found;
}

void SetApproaches(const Motion& motion, const SearchBodies& bodies, double bin_s,
                   FoundContacts& found) {
  for (size_t i = 0; i < found.blows.size(); ++i) {
    FoundBlow& blow = found.blows[i];
    const auto orientation = [&](uint32_t body) {
      return bodies.motions[body].At(blow.frame, blow.time_s, Path::kKnown).orientation;
    };
    blow.orientation_a = orientation(blow.a);
    blow.orientation_b = orientation(blow.b);
    if (blow.approach_m_per_s > 0) continue;  // It is known from the series.
    const double time_s = blow.SinceFirst(motion.frame_s);
    double before_s = std::max(0.0, time_s - bin_s);
    for (size_t k = i; k-- > 0 && time_s - found.blows[k].SinceFirst(motion.frame_s) < 2 * bin_s;) {
      const FoundBlow& other = found.blows[k];
      const double since_s = time_s - other.SinceFirst(motion.frame_s);
      const bool shares =
          other.a == blow.a || other.a == blow.b || other.b == blow.a || other.b == blow.b;
      if (shares && since_s > kTogether * motion.frame_s) {
        before_s = std::max(before_s, time_s - since_s / 2);
      }
    }
    const auto [frame, since_s] = FrameAt(before_s, motion.frame_s, motion.frame_count());
    const auto velocity = [&, frame = frame, since_s = since_s](uint32_t body, const Turn& turn,
                                                                const Vector& point_m) {
      const BodyMotion& of_body = bodies.motions[body];
      Vector of = of_body.KnownVelocity(frame, since_s, turn * (point_m - of_body.centre_m()));
      if (of_body.balanced()) of += motion.gravity_m_per_s2 * (time_s - before_s);
      return of;
    };
    blow.approach_m_per_s = blow.normal.dot(velocity(blow.b, blow.orientation_b, blow.point_b_m) -
                                            velocity(blow.a, blow.orientation_a, blow.point_a_m));
    const auto per_kg = [&](uint32_t body, const Turn& turn, const Vector& point_m) {
      const BodyMotion& of_body = bodies.motions[body];
      if (!of_body.balanced()) return 0.0;
      const Vector lever = (turn * (point_m - of_body.centre_m())).cross(blow.normal);
      return 1 / of_body.mass_kg() + lever.dot(of_body.InverseInertia(blow.frame) * lever);
    };
    const double changed_m_per_s = std::abs(blow.normal.dot(blow.impulse_newton_seconds)) *
                                   (per_kg(blow.a, blow.orientation_a, blow.point_a_m) +
                                    per_kg(blow.b, blow.orientation_b, blow.point_b_m));
    if (blow.approach_m_per_s < kLeastOfSpeed * changed_m_per_s) blow.approach_m_per_s = 0;
  }
}

void SetAmbiguity(FoundContacts& found, const std::vector<FoundContacts>& others, double frame_s) {
  const auto around = [frame_s](const FoundContacts& of, const FoundBlow& blow) {
    Vector sum = Vector::Zero();
    const double time = static_cast<double>(blow.frame) * frame_s + blow.time_s;
    for (const FoundBlow& other : of.blows) {
      const double when = static_cast<double>(other.frame) * frame_s + other.time_s;
      if (other.a == blow.a && other.b == blow.b && std::abs(when - time) < frame_s) {
        sum += other.impulse_newton_seconds;
      }
    }
    return sum;
  };
  double total = 0, differing = 0;
  for (FoundBlow& blow : found.blows) {
    const Vector own = around(found, blow);
    for (const FoundContacts& other : others) {
      const double differs = (around(other, blow) - own).norm() / std::max(own.norm(), 1e-12);
      blow.ambiguity = std::max(blow.ambiguity, std::min(1.0, differs));
    }
    total += blow.impulse_newton_seconds.norm();
    differing += blow.ambiguity * blow.impulse_newton_seconds.norm();
  }
  for (const FoundContacts& other : others) {
    for (const FoundBlow& blow : other.blows) {
      if (around(found, blow).isZero(0)) {
        differing += blow.impulse_newton_seconds.norm() / static_cast<double>(others.size());
      }
    }
  }
  found.confidence.ambiguity = total > 0 ? std::min(1.0, differing / total) : 0;
}

}  // namespace carillon::motion
