// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/examples/falls/fall_scene.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace carillon::falls {
namespace {

using Json = nlohmann::json;

Box BoxFrom(const Json& json) {
  return {.sides_m = json.at("sides_m"),
          .position_m = json.value("position_m", Vector{}),
          .orientation = json.value("orientation", Quaternion{1, 0, 0, 0})};
}

std::variant<Plane, Ball, std::vector<Box>, Hull> ShapeFrom(const Json& json) {
  if (json.contains("ball")) return Ball{.radius_m = json["ball"].at("radius_m")};
  if (json.contains("hull")) return Hull{.corners_m = json["hull"].at("corners_m")};
  if (!json.contains("boxes")) return json.at("plane"), Plane{};
  std::vector<Box> boxes;
  for (const Json& box : json["boxes"]) boxes.push_back(BoxFrom(box));
  return boxes;
}

Body BodyFrom(const Json& json) {
  return {.name = json.at("name"),
          .shape = ShapeFrom(json.at("shape")),
          .mass_kg = json.value("mass_kg", 0.0),
          .inertia_kg_m2 = json.value("inertia_kg_m2", Vector{}),
          .position_m = json.value("position_m", Vector{}),
          .orientation = json.value("orientation", Quaternion{1, 0, 0, 0}),
          .velocity_m_per_s = json.value("velocity_m_per_s", Vector{}),
          .angular_velocity_rad_per_s = json.value("angular_velocity_rad_per_s", Vector{}),
          .model = json.value("model", ""),
          .material = json.value("material", "")};
}

FallScene SceneFrom(const Json& json) {
  FallScene scene;
  scene.gravity_m_per_s2 = json.value("gravity_m_per_s2", scene.gravity_m_per_s2);
  scene.friction = json.value("friction", scene.friction);
  scene.restitution = json.value("restitution", scene.restitution);
  scene.roughness_depth = json.value("roughness_depth", scene.roughness_depth);
  scene.irregularity_length_m = json.value("irregularity_length_m", scene.irregularity_length_m);
  scene.seconds = json.value("seconds", scene.seconds);
  for (const Json& body : json.at("bodies")) scene.bodies.push_back(BodyFrom(body));
  return scene;
}

}  // namespace

absl::StatusOr<FallScene> ReadFallScene(const std::string& path) {
  std::ifstream file(path);
  if (!file) return absl::NotFoundError(absl::StrCat(path, " cannot be opened"));
  try {
    return SceneFrom(Json::parse(file));
  } catch (const Json::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", error.what()));
  }
}

}  // namespace carillon::falls
