// SPDX-License-Identifier: Apache-2.0
#include "server/scene/body_impulses.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "proto/cpp/status_macros.h"
#include "server/synthesis/voice/vector3.h"

namespace carillon {
namespace {

absl::StatusOr<LocatedPoint> Locate(const SoundingObject& object,
                                    const std::variant<Point, SurfacePoint>& location) {
  const SurfaceLocator& locator = *object.body->locator;
  if (const auto* on_surface = std::get_if<SurfacePoint>(&location)) {
    return locator.OnGivenTriangle(*on_surface);
  }
  Point point = std::get<Point>(location);
  for (double& coordinate : point) coordinate /= object.properties.material.size;
  return locator.Nearest(point);
}

/// Distance by which the shapes of engines differ from bodies along a face, metres: corners are
/// rounded off, and a body turns within a step.
constexpr double kEngineToleranceM = 0.002;
/// The same for small bodies, as a part of their extent.
constexpr double kEngineTolerance = 0.02;

/// Locates a contact as Locate does, but moves a contact that an engine has found beneath an edge
/// or beside it onto the edge.
absl::StatusOr<LocatedPoint> LocateEngines(const SoundingObject& object,
                                           const std::variant<Point, SurfacePoint>& location,
                                           const Vector3& impulse) {
  ASSIGN_OR_RETURN(const LocatedPoint& nearest, Locate(object, location));
  if (!std::holds_alternative<Point>(location)) return nearest;
  const double size = object.properties.material.size;
  const SoundingBody& body = *object.body;
  Point point = std::get<Point>(location);
  for (double& coordinate : point) coordinate /= size;
  std::optional<Point> edge = body.edges.Protruding(point, nearest.distance_m, impulse);
  if (!edge) {
    const double tolerance_m = std::min(kEngineToleranceM / size, kEngineTolerance * body.extent_m);
    edge = body.edges.Beside(body.At(nearest), tolerance_m, impulse);
  }
  if (!edge) return nearest;
  ASSIGN_OR_RETURN(LocatedPoint on_edge, body.locator->Nearest(*edge));
  on_edge.distance_m = nearest.distance_m;
  return on_edge;
}

/// Returns the rotation from the frame of `from` into that of `to`, by the poses of both.
Quaternion RotationBetween(const SoundingObject& from, const SoundingObject& to) {
  const auto orientation = [](const SoundingObject& object) {
    const std::optional<Pose>& pose = object.properties.pose;
    return pose ? Normalized(pose->orientation) : Quaternion();
  };
  return Product(Inverse(orientation(to)), orientation(from));
}

double MassKg(const SoundingObject& object) {
  const SoundingMaterial& material = object.properties.material;
  const double volume = object.body->volume_m3 * material.size * material.size * material.size;
  return volume > 0 ? volume * material.density_kg_per_m3 : std::numeric_limits<double>::infinity();
}

/// Returns the angular impulse as BodyImpulse::turn has it.
Vector3 TurnOf(const SoundingObject& object, const Vector3& point_m, const Vector3& impulse) {
  const double size = object.properties.material.size;
  const Vector3& centre = object.body->centre_m;
  const std::array<Vector3, 3>& root = object.body->inertia_root;
  if (root[0][0] == 0) return {};
  const Vector3 arm{point_m[0] - size * centre[0], point_m[1] - size * centre[1],
                    point_m[2] - size * centre[2]};
  const Vector3 angular{arm[1] * impulse[2] - arm[2] * impulse[1],
                        arm[2] * impulse[0] - arm[0] * impulse[2],
                        arm[0] * impulse[1] - arm[1] * impulse[0]};
  const double scale =
      1 / std::sqrt(object.properties.material.density_kg_per_m3 * std::pow(size, 5));
  Vector3 turn{};
  for (size_t row = 0; row < 3; ++row) {
    double rest = scale * angular[row];
    for (size_t k = 0; k < row; ++k) rest -= root[row][k] * turn[k];
    turn[row] = rest / root[row][row];
  }
  return turn;
}

/// Returns the mass of the point that an impulse strikes: the impulse squared over twice the energy
/// that it gives the object.
double MassAtPointKg(const BodyImpulse& on_body) {
  const double squared = Dot(on_body.pressing, on_body.pressing);
  const double turn = Dot(on_body.turn, on_body.turn);
  return squared > 0 ? 1 / (1 / on_body.mass_kg + turn / squared) : on_body.mass_kg;
}

/// Returns the object as one of two bodies that collide at `located`.
ElasticBody ElasticBodyAt(const SoundingObject& object, const LocatedPoint& located,
                          const BodyImpulse& impulse) {
  const ModalModel& model = *object.body->model;
  const Point point = object.body->At(located);
  const uint32_t given = model.given_triangle[located.triangle];
  const SoundingMaterial& material = object.properties.material;
  ElasticBody body{.young_pa = material.young_pa,
                   .poisson_ratio = PoissonRatioOf(model, object.properties),
                   .mass_kg = MassAtPointKg(impulse),
                   .curvature_per_m = object.body->curvature.At(given, point, material.size)};
  if (model.regions.empty()) return body;
  const size_t region = model.given_triangle_regions[given];
  body.young_pa = material.regions[region].young_pa;
  body.poisson_ratio = model.regions[region].poisson_ratio;
  return body;
}

double Magnitude(const Vector3& vector) { return std::hypot(vector[0], vector[1], vector[2]); }

/// Returns the part of an impulse along the contact's normal, or the impulse if there is no normal
/// or one that cannot be right.
Vector3 PressingPart(const ContactImpulse& contact) {
  constexpr double kLeastAlong = 0.1;  // no friction is ten times the load
  const Vector3& impulse = contact.impulse_newton_seconds;
  Vector3 part = contact.normal;
  const double largest = std::max({std::abs(part[0]), std::abs(part[1]), std::abs(part[2])});
  if (largest == 0) return impulse;
  for (double& component : part) component /= largest;
  const double along = Dot(impulse, part), squared = Dot(part, part);
  if (along * along < kLeastAlong * kLeastAlong * squared * Dot(impulse, impulse)) return impulse;
  for (double& component : part) component *= along / squared;
  return part;
}

/// Fills in the impulse on one object, except for its pulse.
void FillIn(const SoundingObject& object, const LocatedPoint& located, const Vector3& impulse,
            const Vector3& pressing, BodyImpulse& on_body) {
  const auto narrow = [](double x) { return static_cast<float>(x); };
  SurfaceImpulse surface{.at = {.vertices = located.vertices}};
  std::ranges::transform(located.weights, surface.at.weights.begin(), narrow);
  std::ranges::transform(impulse, surface.impulse_newton_seconds.begin(), narrow);
  on_body.event = {.bank = object.bank, .action = surface};
  const SoundingMaterial& material = object.properties.material;
  on_body.distance_m = located.distance_m * material.size;
  on_body.extent_m = object.body->extent_m * material.size;
  on_body.mass_kg = MassKg(object);
  on_body.point_m = object.body->At(located);
  for (double& coordinate : on_body.point_m) coordinate *= material.size;
  on_body.pressing = pressing;
  on_body.turn = TurnOf(object, on_body.point_m, pressing);
  on_body.serial = object.serial;
  on_body.largest_newton_seconds =
      10 * on_body.mass_kg * std::sqrt(material.young_pa / material.density_kg_per_m3);
}

void SetDuration(double duration_s, BodyImpulses& impulses) {
  for (BodyImpulse& one : impulses.all()) {
    std::get<SurfaceImpulse>(one.event.action).pulse =
        Pulse::RaisedCosine(static_cast<float>(duration_s));
  }
}

/// Returns the opposite of a part of the impulse, in the frame of the second object.
Vector3 Opposite(const Vector3& impulse, const ObjectContact& contact, const SoundingObject& object,
                 const SoundingObject& second) {
  const Quaternion rotation = contact.second->rotation.value_or(RotationBetween(object, second));
  Vector3 opposite = Rotated(impulse, Normalized(rotation));
  std::ranges::transform(opposite, opposite.begin(), std::negate());
  return opposite;
}

}  // namespace

absl::Status FindBodyImpulses(const ObjectContact& contact, PointSource source,
                              const SoundingObject& object, const SoundingObject* second,
                              BodyImpulses& impulses) {
  const ContactImpulse& impulse = contact.impulse;
  if (second != nullptr && contact.second->rotation) {
    RETURN_IF_ERROR(Validate(*contact.second->rotation));
  }
  RETURN_IF_ERROR(Validate(impulse));
  const auto locate = [&](const SoundingObject& of, const auto& location, const Vector3& felt_by) {
    return source == PointSource::kEngine ? LocateEngines(of, location, felt_by)
                                          : Locate(of, location);
  };
  ASSIGN_OR_RETURN(const LocatedPoint& located,
                   locate(object, impulse.location, impulse.impulse_newton_seconds));
  impulses.by[0].handle = contact.handle;
  impulses.count = 1;
  const Vector3 pressing = PressingPart(impulse);
  FillIn(object, located, impulse.impulse_newton_seconds, pressing, impulses.by[0]);
  ElasticBody striker = kSteelTip;
  if (second != nullptr) {
    const Vector3 opposite = Opposite(impulse.impulse_newton_seconds, contact, object, *second);
    ASSIGN_OR_RETURN(const LocatedPoint& on_second,
                     locate(*second, contact.second->location, opposite));
    impulses.by[1].handle = contact.second->handle;
    impulses.count = 2;
    FillIn(*second, on_second, opposite, Opposite(pressing, contact, object, *second),
           impulses.by[1]);
    striker = ElasticBodyAt(*second, on_second, impulses.by[1]);
  }
  if (impulse.duration_s) {
    SetDuration(*impulse.duration_s, impulses);
    return absl::OkStatus();
  }
  const ElasticBody struck = ElasticBodyAt(object, located, impulses.by[0]);
  const Collision collision{
      .reduced_mass_kg = ReducedMassKg(struck, striker, impulse.hertz),
      .stated_speed_m_per_s = impulse.hertz.approach_speed_m_per_s.value_or(0)};
  for (BodyImpulse& one : impulses.all()) one.collision = collision;
  impulses.duration_follows_impulse = !impulse.hertz.approach_speed_m_per_s;
  impulses.mass_is_stated = impulse.hertz.reduced_mass_kg.has_value();
  if (second == nullptr) {
    const bool knows = impulse.hertz.striker_mass_kg && !impulse.hertz.striker_mass_is_named;
    impulses.striker_per_kg =
        knows ? std::optional(1 / *impulse.hertz.striker_mass_kg) : std::nullopt;
  }
  SetDuration(HertzDurationS(struck, striker, impulse.hertz, Magnitude(pressing)), impulses);
  return absl::OkStatus();
}

}  // namespace carillon
