// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/foley_bodies.h"

#include <fnmatch.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using motion::MovingBody;
using motion::Vector;

/// Half the side of the floor, and its thickness, m.
constexpr double kFloorHalfM = 50, kFloorThickM = 1;

absl::Status Refused(absl::string_view reason, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, what);
}

bool Fits(const std::string& pattern, const std::string& name) {
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

/// Returns what the last fitting choice gives the body, or nullopt.
std::optional<std::string> Chosen(const std::vector<BodyChoice>& choices, const std::string& name) {
  std::optional<std::string> chosen;
  for (const auto& [pattern, value] : choices) {
    if (Fits(pattern, name)) chosen = value;
  }
  return chosen;
}

/// Whether a pattern fits one name alone.
bool IsName(const std::string& pattern) {
  for (size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] == '\\') {
      ++i;
    } else if (absl::string_view("*?[").find(pattern[i]) != absl::string_view::npos) {
      return false;
    }
  }
  return true;
}

/// Whether the last fitting choice names the body.
bool IsNamed(const std::vector<BodyChoice>& choices, const std::string& name) {
  bool named = false;
  for (const auto& [pattern, value] : choices) {
    if (Fits(pattern, name)) named = IsName(pattern);
  }
  return named;
}

absl::Status CheckPattern(const std::string& option, const std::string& pattern,
                          const motion::Motion& motion) {
  const auto fits = [&](const MovingBody& body) { return Fits(pattern, body.name); };
  if (std::ranges::any_of(motion.bodies, fits)) return absl::OkStatus();
  const auto name = [](std::string* text, const MovingBody& body) {
    absl::StrAppend(text, body.name);
  };
  return Refused("BODY_UNKNOWN",
                 absl::StrCat(option, " ", pattern, " fits none of the bodies ",
                              absl::StrJoin(motion.bodies, ", ", name),
                              option == "--mesh" ? "; one that stays needs poses, too" : ""));
}

absl::Status CheckPatterns(const FoleyOptions& options, const motion::Motion& motion) {
  const std::pair<const char*, const std::vector<BodyChoice>*> given[] = {
      {"--material", &options.materials},
      {"--mesh", &options.meshes},
      {"--wall", &options.walls},
      {"--mass", &options.masses}};
  for (const auto& [option, choices] : given) {
    for (const BodyChoice& choice : *choices) {
      RETURN_IF_ERROR(CheckPattern(option, choice.first, motion));
    }
  }
  for (const std::string& pattern : options.driven) {
    RETURN_IF_ERROR(CheckPattern("--driven", pattern, motion));
  }
  for (const std::string& pattern : options.repaired) {
    RETURN_IF_ERROR(CheckPattern("--repair", pattern, motion));
  }
  return absl::OkStatus();
}

absl::StatusOr<double> NumberOf(const std::string& option, const BodyChoice& choice) {
  double number = 0;
  if (absl::SimpleAtod(choice.second, &number) && number > 0) return number;
  return Refused("INVALID_SETTINGS", absl::StrCat(option, " ", choice.first, "=", choice.second,
                                                  ": the number must be above zero"));
}

bool FitsAny(const std::vector<std::string>& patterns, const std::string& name) {
  return std::ranges::any_of(patterns, [&](const auto& pattern) { return Fits(pattern, name); });
}

bool IsCatalogued(const std::string& name) {
  v1::Material material;
  material.set_preset(name);
  return ResolveMaterial(material).ok();
}

/// Returns the material of a body: the chosen one, or that of the file if the catalogue has it.
absl::StatusOr<std::string> MaterialOf(const FoleyOptions& options, const std::string& name,
                                       const std::string& in_file) {
  if (const auto chosen = Chosen(options.materials, name)) {
    if (*chosen == "none") return "";
    v1::Material material;
    material.set_preset(*chosen);
    RETURN_IF_ERROR(ResolveMaterial(material).status());
    return *chosen;
  }
  std::string guess = absl::StrReplaceAll(absl::AsciiStrToLower(in_file), {{" ", "_"}, {"-", "_"}});
  return !guess.empty() && IsCatalogued(guess) ? guess : "";
}

absl::Status SetSurface(const FoleyOptions& options, MovingBody& body) {
  if (const auto file = Chosen(options.meshes, body.name)) {
    ASSIGN_OR_RETURN(body.surface, motion::ReadObjSurface(*file));
  }
  if (body.surface.triangles.empty()) {
    return Refused("BODY_UNKNOWN", absl::StrCat(body.name, " has no surface: give --mesh '",
                                                body.name, "=FILE.obj'"));
  }
  return absl::OkStatus();
}

/// Sets mass, centre and inertia of a body that moves. Without a mass in the file it is that of the
/// material; the inertia is that of a solid, as simulators take it.
absl::Status SetMass(const FoleyOptions& options, const motion::SceneBody& given, FoleyBody& sounds,
                     MovingBody& body) {
  const bool driven = given.driven || FitsAny(options.driven, body.name);
  body.mass_kg = 0;
  if (driven || body.poses.size() < 2) return absl::OkStatus();
  const motion::SolidMeasures solid = motion::Measure(body.surface);
  body.mass_kg = given.mass_kg;
  if (const auto mass = Chosen(options.masses, body.name)) {
    ASSIGN_OR_RETURN(body.mass_kg, NumberOf("--mass", {body.name, *mass}));
  }
  if (!sounds.material.empty()) {
    v1::Material material;
    material.set_preset(sounds.material);
    ASSIGN_OR_RETURN(material, ResolveMaterial(material));
    const double shell_m3 = sounds.wall_m > 0 ? solid.area_m2 * sounds.wall_m : solid.volume_m3;
    sounds.material_mass_kg =
        material.density_kg_per_m3() * std::max(0.0, std::min(shell_m3, solid.volume_m3));
  }
  if (body.mass_kg == 0) body.mass_kg = sounds.material_mass_kg;
  if (body.mass_kg == 0) return absl::OkStatus();
  if (!(solid.volume_m3 > 0) && !given.has_inertia) {
    return Refused("SURFACE_OPEN", absl::StrCat(body.name,
                                                " encloses no volume, so that its inertia is "
                                                "unknown: close it, or turn its faces outward"));
  }
  if (!given.has_centre) body.centre_of_mass_m = solid.centre_m;
  if (!given.has_inertia) body.inertia_kg_m2 = body.mass_kg * solid.inertia_per_kg;
  return absl::OkStatus();
}

/// Adds a thick square whose upper side is at a height against gravity, and which reaches beyond
/// all bodies.
void AddFloor(double height_m, double metres_per_unit, FoleyScene& foley) {
  const Vector& gravity = foley.scene.motion.gravity_m_per_s2;
  Eigen::AlignedBox3d places;
  for (const MovingBody& body : foley.scene.motion.bodies) {
    for (const motion::BodyPose& pose : body.poses)
      places.extend(metres_per_unit * pose.position_m);
  }
  MovingBody floor;
  floor.name = "floor";
  const Vector up = gravity.norm() > 0 ? Vector(-gravity.normalized()) : Vector(Vector::UnitZ());
  const Vector centre = places.isEmpty() ? Vector(Vector::Zero()) : places.center();
  const double half_m = kFloorHalfM + (places.isEmpty() ? 0 : places.diagonal().norm());
  floor.poses.push_back({centre + (height_m - up.dot(centre)) * up,
                         motion::Turn::FromTwoVectors(Vector::UnitZ(), up)});
  for (uint32_t i = 0; i < 8; ++i) {
    floor.surface.vertices_m.emplace_back((i & 1U) != 0 ? half_m : -half_m,
                                          (i & 2U) != 0 ? half_m : -half_m,
                                          (i & 4U) != 0 ? 0 : -kFloorThickM);
  }
  floor.surface.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  foley.scene.motion.bodies.push_back(floor);
  foley.scene.bodies.emplace_back();
}

absl::Status SetBody(const FoleyOptions& options, const motion::SceneBody& given, MovingBody& body,
                     FoleyBody& sounds) {
  sounds.endless = body.name == "floor" && options.floor_m;
  if (!sounds.endless) {
    RETURN_IF_ERROR(SetSurface(options, body));
    ScaleShape(options.metres_per_unit, body);
    for (motion::BodyPose& pose : body.poses) pose.position_m *= options.metres_per_unit;
    motion::TurnOutward(body.surface);
    motion::TurnOutward(body.collider);
  }
  // The cone of friction needs a width.
  if (options.friction) body.friction = std::max(*options.friction, 1e-3);
  ASSIGN_OR_RETURN(sounds.material, MaterialOf(options, body.name, given.material));
  if (sounds.endless || (body.poses.size() == 1 && !IsNamed(options.materials, body.name))) {
    sounds.scenery = std::exchange(sounds.material, "");
  }
  if (const auto wall = Chosen(options.walls, body.name)) {
    ASSIGN_OR_RETURN(sounds.wall_m, NumberOf("--wall", {body.name, *wall}));
  }
  sounds.closed = motion::IsClosed(body.surface);
  sounds.repair = !sounds.closed && (options.force || FitsAny(options.repaired, body.name));
  return SetMass(options, given, sounds, body);
}

}  // namespace

void ScaleShape(double factor, MovingBody& body) {
  for (Vector& vertex : body.surface.vertices_m) vertex *= factor;
  for (Vector& vertex : body.collider.vertices_m) vertex *= factor;
  body.rounding_m *= factor;
  body.centre_of_mass_m *= factor;
  body.inertia_kg_m2 *= factor * factor;
}

absl::StatusOr<FoleyScene> ReadFoleyScene(const FoleyOptions& options) {
  const bool is_gltf = absl::EndsWithIgnoreCase(options.file, ".glb") ||
                       absl::EndsWithIgnoreCase(options.file, ".gltf");
  FoleyScene foley;
  ASSIGN_OR_RETURN(foley.scene, is_gltf ? motion::ReadGltfMotion(options.file, options.force)
                                        : motion::ReadPoseTable(options.file));
  motion::Motion& motion = foley.scene.motion;
  motion.frames_are_steps = options.frames_are_steps;
  if (options.gravity_m_per_s2) {
    const auto& g = *options.gravity_m_per_s2;
    motion.gravity_m_per_s2 = {g[0], g[1], g[2]};
  }
  if (options.floor_m) AddFloor(*options.floor_m, options.metres_per_unit, foley);
  RETURN_IF_ERROR(CheckPatterns(options, motion));
  foley.bodies.resize(motion.bodies.size());
  for (size_t i = 0; i < motion.bodies.size(); ++i) {
    RETURN_IF_ERROR(SetBody(options, foley.scene.bodies[i], motion.bodies[i], foley.bodies[i]));
  }
  return foley;
}

}  // namespace carillon::cli
