// SPDX-License-Identifier: Apache-2.0
#include "tests/client_sdk/motion/fall_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <utility>

namespace carillon::motion {
namespace {

using Key = std::pair<uint32_t, uint32_t>;
constexpr double kOneContactS = 0.001, kTogetherS = 0.008, kLeastShare = 0.03, kLeastSpeed = 0.02;

/// One step of one pair.
struct StepImpulse {
  Vector impulse = Vector::Zero(), moment = Vector::Zero();  ///< of points, weighted by size
  double size = 0;
};

double ReducedMass(const Motion& motion, const PairBlow& blow) {
  const auto inverse = [&](uint32_t body) {
    const MovingBody& b = motion.bodies[body];
    return b.mass_kg > 0 ? 1 / b.mass_kg : 0;
  };
  return 1 / (inverse(blow.a) + inverse(blow.b));
}

Vector ToVector(const falls::Vector& v) { return {v[0], v[1], v[2]}; }

BodySurface BoxSurface(const std::vector<falls::Box>& boxes) {
  BodySurface surface;
  for (const falls::Box& box : boxes) {
    const auto first = static_cast<uint32_t>(surface.vertices_m.size());
    for (uint32_t i = 0; i < 8; ++i) {
      const Vector sign((i & 1U) != 0 ? 0.5 : -0.5, (i & 2U) != 0 ? 0.5 : -0.5,
                        (i & 4U) != 0 ? 0.5 : -0.5);
      surface.vertices_m.emplace_back(ToVector(box.position_m) +
                                      ToVector(box.sides_m).cwiseProduct(sign));
    }
    for (const std::array<uint32_t, 4>& q : {std::array<uint32_t, 4>{0, 2, 3, 1},
                                             {4, 5, 7, 6},
                                             {0, 1, 5, 4},
                                             {2, 6, 7, 3},
                                             {0, 4, 6, 2},
                                             {1, 3, 7, 5}}) {
      surface.triangles.push_back({first + q[0], first + q[1], first + q[2]});
      surface.triangles.push_back({first + q[0], first + q[2], first + q[3]});
    }
  }
  return surface;
}

/// A sphere of triangles: the poles, and rings of vertices between them.
BodySurface BallSurface(double radius) {
  constexpr uint32_t kRings = 24, kAround = 48;
  BodySurface surface;
  surface.vertices_m.emplace_back(0, 0, radius);
  for (uint32_t ring = 1; ring < kRings; ++ring) {
    const double down = std::numbers::pi * ring / kRings;
    for (uint32_t i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * (i + (ring % 2) * 0.5) / kAround;
      surface.vertices_m.emplace_back(radius * Vector(std::sin(down) * std::cos(angle),
                                                      std::sin(down) * std::sin(angle),
                                                      std::cos(down)));
    }
  }
  surface.vertices_m.emplace_back(0, 0, -radius);
  const uint32_t last = 1 + (kRings - 2) * kAround, south = last + kAround;
  for (uint32_t i = 0; i < kAround; ++i) {
    const uint32_t j = (i + 1) % kAround;
    surface.triangles.push_back({0, 1 + i, 1 + j});
    surface.triangles.push_back({south, last + j, last + i});
    for (uint32_t ring = 0; ring + 2 < kRings; ++ring) {
      const uint32_t upper = 1 + ring * kAround, lower = upper + kAround;
      surface.triangles.push_back({upper + i, lower + i, lower + j});
      surface.triangles.push_back({upper + i, lower + j, upper + j});
    }
  }
  return surface;
}

void Round(BodyPose& pose) {
  for (int i = 0; i < 3; ++i) pose.position_m[i] = static_cast<float>(pose.position_m[i]);
  for (int i = 0; i < 4; ++i)
    pose.orientation.coeffs()[i] = static_cast<float>(pose.orientation.coeffs()[i]);
}

/// Takes blows of one pair together that follow each other within `within_s`.
std::vector<PairBlow> Together(const std::vector<PairBlow>& blows, double within_s) {
  std::vector<PairBlow> groups;
  double last_s = 0;
  for (const PairBlow& blow : blows) {
    if (groups.empty() || blow.time_s - std::exchange(last_s, blow.time_s) > within_s) {
      groups.push_back(blow);
      last_s = blow.time_s;
      continue;
    }
    PairBlow& group = groups.back();
    const double size = blow.impulse.norm(), share = size / (group.impulse.norm() + size);
    group.time_s += share * (blow.time_s - group.time_s);
    group.point_m += share * (blow.point_m - group.point_m);
    group.impulse += blow.impulse;
  }
  return groups;
}

/// The impulse in each step of the load among `steps`. It is a mean, because a load of MuJoCo comes
/// and goes from step to step, but one without blows.
double LoadOf(std::span<const StepImpulse> steps) {
  double load = std::numeric_limits<double>::infinity(), before = 0;
  do {
    before = load;
    double sum = 0;
    size_t count = 0;
    for (const StepImpulse& step : steps) {
      if (step.size > 3 * before) continue;
      sum += step.size;
      ++count;
    }
    load = count > 0 ? sum / static_cast<double>(count) : 0;
  } while (load < before);
  return load;
}

/// The contacts of a simulation, step by step.
class TruthReader {
 public:
  explicit TruthReader(const Motion& motion) : motion_(motion) {
    for (uint32_t i = 0; i < motion.bodies.size(); ++i) {
      if (motion.bodies[i].mass_kg == 0) fixed_ = i;
    }
  }

  void Read(const v1::ContactStep& step, const std::vector<BodyPose>& poses) {
    ++steps_;
    for (const v1::Contact& row : step.contacts()) {
      const uint32_t a = row.object() - 1;
      const uint32_t b = row.has_second() ? row.second().object() - 1 : fixed_;
      const auto& j = row.impulse_newton_seconds();
      const Vector impulse = poses[a].orientation * Vector(j.x(), j.y(), j.z());
      std::vector<StepImpulse>& series = series_[{a, b}];
      series.resize(steps_);
      series.back().impulse += impulse;
      series.back().size += impulse.norm();
      series.back().moment +=
          impulse.norm() * Vector(row.point_m().x(), row.point_m().y(), row.point_m().z());
    }
  }

  std::vector<PairBlow> Blows(double step_s) {
    std::vector<PairBlow> blows;
    for (auto& [key, series] : series_) {
      series.resize(steps_);
      AddBlows(key, series, step_s, blows);
    }
    std::ranges::sort(blows, {}, &PairBlow::time_s);
    return blows;
  }

 private:
  void AddBlows(const Key& key, const std::vector<StepImpulse>& series, double step_s,
                std::vector<PairBlow>& blows) const {
    const double mass = ReducedMass(motion_, {.a = key.first, .b = key.second}),
                 least = mass * std::min(2 * 9.81 * step_s, kLeastSpeed);
    // Soft contacts last for tens of milliseconds.
    const auto around = static_cast<size_t>(0.06 / step_s);
    std::vector<PairBlow> steps;
    for (size_t i = 0; i < series.size(); ++i) {
      const auto& [impulse, moment, size] = series[i];
      if (size <= least) continue;
      const size_t first = i > around ? i - around : 0;
      const auto near =
          std::span(series).subspan(first).first(std::min(series.size(), i + around + 1) - first);
      if (size < least + 3 * LoadOf(near)) continue;
      // An engine of half implicit steps applies an impulse at the beginning of its step.
      steps.push_back({.a = key.first,
                       .b = key.second,
                       .time_s = static_cast<double>(i) * step_s,
                       .impulse = impulse,
                       .point_m = moment / size});
    }
    for (const PairBlow& blow : Together(Together(steps, kOneContactS), kTogetherS)) {
      if (blow.impulse.norm() > kLeastSpeed * mass) blows.push_back(blow);
    }
  }

  const Motion& motion_;
  uint32_t fixed_ = 0;
  size_t steps_ = 0;
  std::map<Key, std::vector<StepImpulse>> series_;
};

std::vector<PairBlow> Strong(const Motion& motion, std::vector<PairBlow> blows, double strongest) {
  std::erase_if(blows, [&](const PairBlow& blow) {
    return blow.impulse.norm() / std::sqrt(ReducedMass(motion, blow)) < kLeastShare * strongest;
  });
  return blows;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  const double place = share * static_cast<double>(values.size() - 1);
  return values[static_cast<size_t>(std::lround(place))];
}

/// The surface of a body as a mesh.
BodySurface SurfaceOf(const falls::Body& body) {
  if (const auto* ball = std::get_if<falls::Ball>(&body.shape)) return BallSurface(ball->radius_m);
  if (const auto* boxes = std::get_if<std::vector<falls::Box>>(&body.shape))
    return BoxSurface(*boxes);
  return BoxSurface({{.sides_m = {20, 20, 1}, .position_m = {0, 0, -0.5}}});
}

}  // namespace

MovingBody ToMoving(const falls::Body& body) {
  MovingBody moving;
  moving.name = body.name;
  moving.surface = SurfaceOf(body);
  moving.mass_kg = body.mass_kg;
  moving.inertia_kg_m2 = ToVector(body.inertia_kg_m2).asDiagonal();
  return moving;
}

Fall Drop(const falls::FallScene& scene, const Engine& engine, int steps_per_frame, double step_s) {
  Fall fall;
  fall.motion.frame_s = steps_per_frame * step_s;
  fall.motion.gravity_m_per_s2 = ToVector(scene.gravity_m_per_s2);
  falls::FallScene heard = scene;
  std::vector<BodyPose> poses;
  for (falls::Body& body : heard.bodies) {
    if (body.mass_kg > 0) body.model = "heard";
    MovingBody& moving = fall.motion.bodies.emplace_back(ToMoving(body));
    moving.friction = 1.2 * scene.friction;
    const auto& q = body.orientation;
    poses.push_back({ToVector(body.position_m), Turn(q[0], q[1], q[2], q[3]).normalized()});
    Round(poses.back());
    moving.poses.push_back(poses.back());
  }
  const falls::Simulation simulation = engine(heard, step_s);
  TruthReader truth(fall.motion);
  const int steps = static_cast<int>(std::lround(scene.seconds / step_s));
  for (int i = 1; i <= steps; ++i) {
    const v1::ContactStep step = simulation();
    truth.Read(step, poses);
    for (int n = 0; n < step.poses().object_size(); ++n) {
      const auto body = step.poses().object(n) - 1;
      const auto* x = &step.poses().position_m()[3 * n];
      const auto* q = &step.poses().orientation()[4 * n];
      poses[body] = {{x[0], x[1], x[2]}, Turn(q[0], q[1], q[2], q[3]).normalized()};
      Round(poses[body]);
      if (i % steps_per_frame == 0) fall.motion.bodies[body].poses.push_back(poses[body]);
    }
  }
  fall.blows = truth.Blows(step_s);
  return fall;
}

std::vector<PairBlow> Clustered(const Motion& motion, const FoundContacts& found) {
  std::map<Key, std::vector<PairBlow>> of_pair;
  for (const FoundBlow& blow : found.blows) {
    const bool swapped = motion.bodies[blow.a].mass_kg == 0;
    const Key key = swapped ? Key{blow.b, blow.a} : Key{blow.a, blow.b};
    of_pair[key].push_back(
        {.a = key.first,
         .b = key.second,
         .time_s = static_cast<double>(blow.frame) * motion.frame_s + blow.time_s,
         .impulse = (swapped ? -1 : 1) * blow.impulse_newton_seconds,
         .point_m = swapped ? blow.point_b_m : blow.point_a_m});
  }
  std::vector<PairBlow> all;
  for (const auto& [key, blows] : of_pair) {
    for (const PairBlow& blow : Together(blows, kTogetherS)) all.push_back(blow);
  }
  std::ranges::sort(all, {}, &PairBlow::time_s);
  return all;
}

Likeness Compare(const Fall& fall, const FoundContacts& contacts) {
  const Motion& motion = fall.motion;
  double strongest = 0;
  for (const PairBlow& blow : fall.blows) {
    strongest = std::max(strongest, blow.impulse.norm() / std::sqrt(ReducedMass(motion, blow)));
  }
  const std::vector<PairBlow> truth = Strong(motion, fall.blows, strongest);
  const std::vector<PairBlow> found = Strong(motion, Clustered(motion, contacts), strongest);
  std::vector<std::tuple<double, size_t, size_t>> matches;
  const double within = std::max(1.01 * motion.frame_s, 0.012);
  for (size_t i = 0; i < truth.size(); ++i) {
    for (size_t k = 0; k < found.size(); ++k) {
      const double dt = std::abs(truth[i].time_s - found[k].time_s);
      if (truth[i].a == found[k].a && truth[i].b == found[k].b && dt < within) {
        matches.emplace_back(dt, i, k);
      }
    }
  }
  std::ranges::sort(matches);
  std::set<size_t> used_true, used_found;
  Likeness likeness{.true_count = static_cast<int>(truth.size())};
  std::vector<double> dts, sizes, vectors, points;
  double total = 0;
  for (const PairBlow& blow : truth) total += blow.impulse.norm();
  for (const auto& [dt, i, k] : matches) {
    if (used_true.contains(i) || used_found.contains(k)) continue;
    used_true.insert(i);
    used_found.insert(k);
    ++likeness.found_count;
    likeness.found_share += truth[i].impulse.norm() / total;
    dts.push_back(dt);
    sizes.push_back(std::abs(found[k].impulse.norm() / truth[i].impulse.norm() - 1));
    vectors.push_back((found[k].impulse - truth[i].impulse).norm() / truth[i].impulse.norm());
    points.push_back((found[k].point_m - truth[i].point_m).norm());
  }
  for (size_t k = 0; k < found.size(); ++k) {
    if (used_found.contains(k)) continue;
    ++likeness.false_count;
    likeness.false_share += found[k].impulse.norm() / total;
  }
  likeness.median_dt_s = Quantile(dts, 0.5);
  likeness.dt90_s = Quantile(dts, 0.9);
  likeness.median_size_error = Quantile(sizes, 0.5);
  likeness.median_vector_error = Quantile(vectors, 0.5);
  likeness.median_point_m = Quantile(points, 0.5);
  return likeness;
}

falls::Body BoxBody(const std::string& name, const falls::Vector& sides, double mass) {
  const auto moment = [&](size_t i, size_t k) {
    return mass * (sides[i] * sides[i] + sides[k] * sides[k]) / 12;
  };
  return {.name = name,
          .shape = std::vector<falls::Box>{{.sides_m = sides}},
          .mass_kg = mass,
          .inertia_kg_m2 = {moment(1, 2), moment(0, 2), moment(0, 1)},
          .model = "",
          .material = ""};
}

falls::Body BallBody(const std::string& name, double radius, double mass) {
  const double moment = 0.4 * mass * radius * radius;
  return {.name = name,
          .shape = falls::Ball{radius},
          .mass_kg = mass,
          .inertia_kg_m2 = {moment, moment, moment},
          .model = "",
          .material = ""};
}

falls::Body FloorBody() {
  return {.name = "floor", .shape = falls::Plane{}, .model = "", .material = ""};
}

/// An oak box of 12 x 9 x 6 cm that lands on two or three corners 15 to 60 ms apart.
falls::FallScene CornerScene() {
  falls::Body box = BoxBody("box", {0.12, 0.09, 0.06}, 0.45);
  box.position_m = {0, 0, 0.3};
  box.orientation = {0.84419, 0.3485584, -0.4056972, -0.03549596};
  box.velocity_m_per_s = {0.3, 0, 0};
  return {.friction = 0.5, .restitution = 0.3, .seconds = 1.2, .bodies = {FloorBody(), box}};
}

falls::FallScene BounceScene() {
  falls::Body ball = BallBody("ball", 0.03, 0.1);
  ball.position_m = {0, 0, 0.4};
  ball.velocity_m_per_s = {0.5, 0.1, 0};
  return {.friction = 0.5, .restitution = 0.6, .seconds = 1.8, .bodies = {FloorBody(), ball}};
}

falls::FallScene AirScene() {
  falls::Body one = BoxBody("one", {0.1, 0.08, 0.06}, 0.4),
              two = BoxBody("two", {0.07, 0.07, 0.12}, 0.3);
  one.position_m = {-0.2, 0, 2};
  one.velocity_m_per_s = {1, 0, 0};
  one.angular_velocity_rad_per_s = {3, 1, -2};
  two.position_m = {0.2, 0.02, 2.01};
  two.velocity_m_per_s = {-1, 0, 0};
  two.angular_velocity_rad_per_s = {-1, 4, 1};
  return {.friction = 0.5, .restitution = 0.3, .seconds = 0.5, .bodies = {FloorBody(), one, two}};
}

/// Six hollow blocks of wood in a pile, and a ball that rolls into them (scene_makers.py). In each
/// further pile the ball starts 3 mm farther away.
falls::FallScene BlocksScene(int pile) {
  constexpr double kSide = 0.05;
  const double mass = 550 * std::pow(kSide, 3) * (1 - std::pow(0.9, 3)), radius = 0.6 * kSide;
  falls::FallScene scene{
      .friction = 0.5, .restitution = 0, .seconds = 2.5, .bodies = {FloorBody()}};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3 - row; ++column) {
      falls::Body block =
          BoxBody("block " + std::to_string(scene.bodies.size()), {kSide, kSide, kSide}, mass);
      block.position_m = {0, (column - (2 - row) / 2.0) * 1.1 * kSide, (row + 0.5) * kSide};
      scene.bodies.push_back(block);
    }
  }
  falls::Body ball = BallBody("ball", radius, 3 * mass);
  ball.position_m = {-8 * kSide - 0.003 * pile, 0.1 * kSide, radius};
  ball.velocity_m_per_s = {2, 0, 0};
  ball.angular_velocity_rad_per_s = {0, 2 / radius, 0};
  scene.bodies.push_back(ball);
  return scene;
}

}  // namespace carillon::motion
