// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/find_contacts.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"
#include "client_sdk/motion/blow_refinement.h"
#include "client_sdk/motion/contact_problem.h"
#include "client_sdk/motion/contact_reading.h"
#include "client_sdk/motion/contact_search.h"
#include "client_sdk/motion/free_fall.h"
#include "client_sdk/motion/hop_series.h"
#include "client_sdk/motion/in_parallel.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::motion {
namespace {

/// A larger turn between two frames cannot be told from one the other way around, rad.
constexpr double kMostTurn = 2.5;
constexpr int kPasses = 3;
constexpr size_t kVariants = 2;

absl::Status Refused(absl::string_view reason, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, what);
}

absl::Status CheckBody(const MovingBody& body, size_t frames) {
  if (body.poses.size() != 1 && body.poses.size() != frames) {
    return Refused("MOTION_MALFORMED",
                   absl::StrCat(body.name, " has ", body.poses.size(), " poses, and another body ",
                                frames, ": give one pose for each frame, or one alone"));
  }
  for (size_t k = 0; k < body.poses.size(); ++k) {
    const BodyPose& pose = body.poses[k];
    if (pose.position_m.allFinite() && std::abs(pose.orientation.norm() - 1) < 1e-3) continue;
    return Refused("MOTION_MALFORMED",
                   absl::StrCat("pose ", k, " of ", body.name,
                                " has a number that is not finite, or a quaternion whose length is "
                                "not 1: repair the file"));
  }
  if (body.mass_kg == 0 || body.poses.size() == 1) return absl::OkStatus();
  const Eigen::SelfAdjointEigenSolver<Matrix> moments(body.inertia_kg_m2);
  if (body.mass_kg > 0 && moments.eigenvalues().minCoeff() > 0) return absl::OkStatus();
  return Refused("MOTION_MALFORMED", absl::StrCat(body.name,
                                                  " has a mass or a moment of inertia that is not "
                                                  "above zero: give both"));
}

absl::Status Check(const Motion& motion) {
  const size_t frames = motion.frame_count();
  if (frames < 4) {
    return Refused("NO_MOTION", frames < 2 ? std::string("no body moves")
                                           : absl::StrCat("the motion has ", frames,
                                                          " frames, and impulses need four"));
  }
  if (!(motion.frame_s > 0) || !motion.gravity_m_per_s2.allFinite()) {
    return Refused("MOTION_MALFORMED", "the time of a frame must be above zero, gravity finite");
  }
  for (const MovingBody& body : motion.bodies) RETURN_IF_ERROR(CheckBody(body, frames));
  return absl::OkStatus();
}

absl::Status CheckTurns(const Motion& motion, const SearchBodies& bodies) {
  for (size_t body = 0; body < bodies.motions.size(); ++body) {
    if (!bodies.motions[body].balanced()) continue;
    for (size_t k = 0; k + 1 < motion.frame_count(); ++k) {
      if (bodies.motions[body].Angle(k) <= kMostTurn) continue;
      return Refused(
          "MOTION_TOO_COARSE",
          absl::StrCat(motion.bodies[body].name, " turns by ", bodies.motions[body].Angle(k),
                       " rad after ", motion.first_time_s + static_cast<double>(k) * motion.frame_s,
                       " s, and more than 2.5 rad between two frames cannot be told "
                       "apart: export more frames a second"));
    }
  }
  return absl::OkStatus();
}

/// The quietest fifth of the nodes of a body tells how noisy its poses are.
double FreeSpeed(const BodyMotion& body, const Motion& motion) {
  const double fall = motion.gravity_m_per_s2.norm() * motion.frame_s;
  const double least = fall > 0 ? std::min(0.03, 0.3 * fall) : 0.03;
  if (!body.balanced()) return least;
  std::vector<double> jumps;
  for (size_t k = 1; k + 1 < motion.frame_count(); ++k) jumps.push_back(body.Jump(k));
  std::ranges::sort(jumps);
  const double quiet = jumps[jumps.size() / 5];
  return std::max(least, std::min(4 * quiet, 0.5 * fall));
}

std::optional<SearchBodies> Prepare(const Motion& motion) {
  SearchBodies bodies;
  bool moves = false;
  for (const MovingBody& body : motion.bodies) {
    bodies.surfaces.push_back(std::make_unique<SurfaceIndex>(body.touching()));
    bodies.motions.emplace_back(body, motion);
    bodies.free_speed.push_back(FreeSpeed(bodies.motions.back(), motion));
    moves = moves || bodies.motions.back().balanced();
  }
  if (!moves) return std::nullopt;
  return bodies;
}

/// Returns the least distance of a vertex of one body from the surface of another at a frame, m, if
/// it is below `far_m`, which is returned otherwise. It is negative inside.
double Distance(const Motion& motion, const SearchBodies& bodies, size_t one, size_t other,
                size_t frame, double far_m) {
  const auto pose = [&](size_t body) {
    return motion.bodies[body].poses[motion.bodies[body].poses.size() > 1 ? frame : 0];
  };
  const BodyPose of_one = pose(one), of_other = pose(other);
  const double rounding_m = motion.bodies[one].rounding_m + motion.bodies[other].rounding_m;
  const SurfaceIndex& surface = *bodies.surfaces[other];
  for (const Vector& vertex : motion.bodies[one].touching().vertices_m) {
    const Vector point = of_other.orientation.conjugate() *
                         (of_one.position_m + of_one.orientation * vertex - of_other.position_m);
    const double outside_m = surface.box().exteriorDistance(point);
    if (outside_m > 0 && outside_m - rounding_m > far_m) continue;
    if (const auto at = surface.Nearest(point, outside_m + surface.box().diagonal().norm())) {
      far_m = std::min(far_m, at->gap_m - rounding_m);
    }
  }
  return far_m;
}

/// Says how far the body whose momentum is least explained was from any other.
void SetNearest(const Motion& motion, const SearchBodies& bodies, Confidence& confidence) {
  const size_t worst = confidence.worst_body;
  confidence.worst_radius_m = bodies.motions[worst].radius_m();
  double nearest = 1e300;
  for (size_t other = 0; other < motion.bodies.size(); ++other) {
    if (other == worst) continue;
    nearest = Distance(motion, bodies, worst, other, confidence.worst_frame, nearest);
  }
  confidence.nearest_gap_m = std::max(0.0, nearest);
}

/// Says which bodies are deepest in each other in the frames around their blows.
void SetDeepest(const Motion& motion, const SearchBodies& bodies, FoundContacts& found) {
  Confidence& confidence = found.confidence;
  for (const FoundBlow& blow : found.blows) {
    const double radius_m =
        std::min(bodies.motions[blow.a].radius_m(), bodies.motions[blow.b].radius_m());
    for (const size_t frame : {size_t{blow.frame}, size_t{blow.frame} + 1}) {
      const double depth_m = -std::min(Distance(motion, bodies, blow.a, blow.b, frame, 0),
                                       Distance(motion, bodies, blow.b, blow.a, frame, 0));
      // A step of a simulator ends anywhere on the way into a floor.
      const double way_m = motion.frames_are_steps ? blow.approach_m_per_s * motion.frame_s : 0;
      if (depth_m <= std::max(confidence.deepest_part * radius_m, way_m)) continue;
      confidence.deepest_part = depth_m / radius_m;
      confidence.deepest_m = depth_m;
      confidence.deepest_a = blow.a;
      confidence.deepest_b = blow.b;
    }
  }
}

/// Says which body is deepest in another in the middle of a free fall, in which it touches nothing.
void SetSunk(const Motion& motion, const SearchBodies& bodies, Confidence& confidence) {
  const auto half_m = [&](size_t body) {
    return bodies.surfaces[body]->box().sizes().minCoeff() / 2 + motion.bodies[body].rounding_m;
  };
  for (size_t body = 0; body < motion.bodies.size(); ++body) {
    const BodyMotion& moves = bodies.motions[body];
    const size_t frame = moves.balanced() ? FindFreeFall(moves, motion, 1).frame : 0;
    for (size_t other = 0; frame > 0 && other < motion.bodies.size(); ++other) {
      if (other == body) continue;
      const double depth_m = -std::min(Distance(motion, bodies, body, other, frame, 0),
                                       Distance(motion, bodies, other, body, frame, 0));
      const double part = depth_m / std::min(half_m(body), half_m(other));
      // A body is wholly inside another on purpose, as in a room that is drawn as a solid.
      if (part <= confidence.sunk_part || depth_m > 2 * moves.radius_m()) continue;
      confidence.sunk_part = part;
      confidence.sunk_m = depth_m;
      confidence.sunk_a = body;
      confidence.sunk_b = other;
    }
  }
}

/// Says how far apart the bodies of the strongest blow are.
void SetApart(const SearchBodies& bodies, FoundContacts& found) {
  const FoundBlow* strongest = nullptr;
  double most = 0;
  for (const FoundBlow& blow : found.blows) {
    const double size = blow.impulse_newton_seconds.norm();
    if (size <= most) continue;
    most = size;
    strongest = &blow;
  }
  if (strongest == nullptr) return;
  const auto place = [&](uint32_t body, const Vector& point_m) -> Vector {
    const BodyMotion& motion = bodies.motions[body];
    const BodyPose at = motion.At(strongest->frame, strongest->time_s, Path::kKnown);
    return at.position_m + at.orientation * (point_m - motion.centre_m());
  };
  const double apart_m =
      (place(strongest->a, strongest->point_a_m) - place(strongest->b, strongest->point_b_m))
          .norm();
  found.confidence.apart_part = apart_m / std::min(bodies.motions[strongest->a].radius_m(),
                                                   bodies.motions[strongest->b].radius_m());
}

}  // namespace

absl::StatusOr<FoundContacts> FindContacts(const Motion& motion, bool even_if_coarse) {
  RETURN_IF_ERROR(Check(motion));
  std::optional<SearchBodies> bodies = Prepare(motion);
  if (!bodies) {
    return Refused("NO_MOTION",
                   "no body with a mass moves: name the bodies that fall, or give "
                   "masses");
  }
  if (!even_if_coarse) RETURN_IF_ERROR(CheckTurns(motion, *bodies));
  ContactSearch search(motion, *bodies);
  std::unique_ptr<ContactProblem> problem;
  std::vector<HopSeries> series;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<Candidate> candidates = search.Find(pass > 0);
    RemoveHops(motion, search.bin_count(), series, candidates);
    problem =
        std::make_unique<ContactProblem>(motion, *bodies, search, std::move(candidates), series);
    problem->Solve();
    if (pass + 1 < kPasses) problem->Tell(bodies->motions);
    if (pass == 0) {
      series =
          FindHops(motion, *bodies, search, ReadContacts(motion, *bodies, search, *problem, {}));
    }
  }
  FoundContacts found = ReadContacts(motion, *bodies, search, *problem, series);
  std::vector<FoundContacts> others(kVariants);
  InParallel(others.size(), [&](size_t i) {
    ContactProblem varied(motion, *bodies, search, problem->candidates(), series);
    varied.Solve(static_cast<int>(i) + 1);
    others[i] = ReadContacts(motion, *bodies, search, varied, series);
  });
  SetAmbiguity(found, others, motion.frame_s);
  RefineBlows(motion, search.pairs(), *bodies, found);
  SetApproaches(motion, *bodies, motion.frame_s / search.bin_count(), found);
  SetNearest(motion, *bodies, found.confidence);
  SetDeepest(motion, *bodies, found);
  SetSunk(motion, *bodies, found.confidence);
  SetApart(*bodies, found);
  return found;
}

}  // namespace carillon::motion
