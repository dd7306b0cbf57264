// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_frame.h"

#include <optional>
#include <variant>

namespace carillon {
namespace {

Pose PoseOf(const SoundingObject& object) { return object.properties.pose.value_or(Pose()); }

Vector3 Inwards(const Vector3& vector, const Pose& pose) {
  return Rotated(vector, Inverse(Normalized(pose.orientation)));
}

/// Transforms a point in space. A point on a triangle is the same in each frame.
void MoveInwards(std::variant<Point, SurfacePoint>& location, const Pose& pose) {
  auto* point = std::get_if<Point>(&location);
  if (point == nullptr) return;
  for (size_t axis = 0; axis < 3; ++axis) (*point)[axis] -= pose.position_m[axis];
  *point = Inwards(*point, pose);
}

}  // namespace

ObjectContact FromSceneFrame(ObjectContact contact, const SoundingObject& object,
                             const SoundingObject* second) {
  const Pose pose = PoseOf(object);
  MoveInwards(contact.impulse.location, pose);
  contact.impulse.impulse_newton_seconds = Inwards(contact.impulse.impulse_newton_seconds, pose);
  contact.impulse.normal = Inwards(contact.impulse.normal, pose);
  if (second == nullptr) return contact;
  MoveInwards(contact.second->location, PoseOf(*second));
  contact.second->rotation = std::nullopt;  // follows from the poses
  return contact;
}

}  // namespace carillon
