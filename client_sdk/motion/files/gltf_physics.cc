// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/motion/files/gltf_physics.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

namespace carillon::motion {

using nlohmann::json;

const json& Member(const json& object, const char* key) {
  static const json none;
  if (!object.is_object()) return none;
  const auto at = object.find(key);
  return at == object.end() ? none : *at;
}

void AddSurface(const GltfSurface& from, BodySurface& to) {
  std::map<std::array<double, 3>, uint32_t> seen;
  for (uint32_t i = 0; i < to.vertices_m.size(); ++i) {
    seen[{to.vertices_m[i].x(), to.vertices_m[i].y(), to.vertices_m[i].z()}] = i;
  }
  std::vector<uint32_t> index;
  index.reserve(from.points.size());
  for (const GltfPoint& p : from.points) {
    const auto [at, is_new] = seen.try_emplace(p, static_cast<uint32_t>(to.vertices_m.size()));
    if (is_new) to.vertices_m.emplace_back(p[0], p[1], p[2]);
    index.push_back(at->second);
  }
  for (size_t i = 0; i + 2 < from.corners.size(); i += 3) {
    const std::array<uint32_t, 3> t = {index[from.corners[i]], index[from.corners[i + 1]],
                                       index[from.corners[i + 2]]};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) to.triangles.push_back(t);
  }
}

namespace {

std::optional<Vector> VectorOf(const json& list) {
  if (!list.is_array() || list.size() != 3) return std::nullopt;
  return Vector(list[0].get<double>(), list[1].get<double>(), list[2].get<double>());
}

/// Moves a point of a node into the frame of its body, which has no scale.
Vector InBody(const GltfMatrix& world, const GltfPoint& point, const BodyPose& pose) {
  const GltfPoint moved = Moved(world, point);
  return pose.orientation.conjugate() * (Vector(moved[0], moved[1], moved[2]) - pose.position_m);
}

void ReadMotion(const json& motion, const GltfMatrix& world, MovingBody& body, SceneBody& about) {
  about.driven = motion.value("isKinematic", false) || motion.value("type", "") == "kinematic";
  about.mass_kg = motion.value("mass", 0.0);
  const json& extras = Member(motion, "extras");
  const auto damping = [&extras](const char* key) {
    const json& share = Member(extras, key);
    return share.is_number() ? std::clamp(share.get<double>(), 0.0, 1.0) : 0.0;
  };
  body.linear_damping = damping("linearDamping");
  body.angular_damping = damping("angularDamping");
  if (const auto centre = VectorOf(Member(motion, "centerOfMass"))) {
    about.has_centre = true;
    body.centre_of_mass_m =
        InBody(world, {centre->x(), centre->y(), centre->z()}, body.poses.front());
  }
  const auto moments = VectorOf(Member(motion, "inertiaDiagonal"));
  if (moments && moments->minCoeff() > 0) {
    Turn axes = Turn::Identity();
    const json& turn = Member(motion, "inertiaOrientation");
    if (turn.is_array() && turn.size() == 4) {
      axes = Turn(turn[3].get<double>(), turn[0].get<double>(), turn[1].get<double>(),
                  turn[2].get<double>())
                 .normalized();
    }
    about.has_inertia = true;
    body.inertia_kg_m2 =
        axes.toRotationMatrix() * moments->asDiagonal() * axes.toRotationMatrix().transpose();
  }
}

void ReadCollider(const GltfDocument& document, const json& collider, const GltfMatrix& world,
                  MovingBody& body) {
  const json& mesh = Member(Member(collider, "geometry"), "mesh");
  if (mesh.is_null()) return;
  for (const json& primitive : Member(document.At("meshes", mesh), "primitives")) {
    GltfSurface surface = ReadPrimitive(document, primitive, json::array());
    for (GltfPoint& p : surface.points) {
      const Vector point = InBody(world, p, body.poses.front());
      p = {point.x(), point.y(), point.z()};
    }
    for (size_t i = 0; IsMirroring(world) && i + 2 < surface.corners.size(); i += 3) {
      std::swap(surface.corners[i + 1], surface.corners[i + 2]);
    }
    AddSurface(surface, body.collider);
  }
  const json& rounding = Member(Member(collider, "extras"), "rounding");
  body.rounding_m = rounding.is_number() ? std::max(0.0, rounding.get<double>()) : 0;
}

}  // namespace

void ReadGltfPhysics(const GltfDocument& document, const json& node, const GltfMatrix& world,
                     MovingBody& body, SceneBody& about) {
  const json& extensions = Member(node, "extensions");
  const json& khronos = Member(extensions, "KHR_physics_rigid_bodies");
  const json& omi = Member(extensions, "OMI_physics_body");
  const json& khronos_motion = Member(khronos, "motion");
  const json& motion = khronos_motion.is_object()          ? khronos_motion
                       : Member(omi, "motion").is_object() ? Member(omi, "motion")
                                                           : omi;
  if (motion.is_object()) ReadMotion(motion, world, body, about);
  const json& collider = Member(khronos, "collider");
  ReadCollider(document, collider, world, body);
  const json& material = Member(collider, "physicsMaterial");
  const json& all =
      Member(Member(Member(document.root(), "extensions"), "KHR_physics_rigid_bodies"),
             "physicsMaterials");
  if (material.is_number_unsigned() && all.is_array() && material.get<size_t>() < all.size()) {
    body.friction = 1.2 * all[material.get<size_t>()].value("dynamicFriction", 0.5);
  }
}

}  // namespace carillon::motion
