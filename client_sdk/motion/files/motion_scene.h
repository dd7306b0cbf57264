// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// What a file says of a body beside its motion.
struct SceneBody {
  std::string material;     ///< the name of its material in the file, or empty
  double mass_kg = 0;       ///< zero: the file does not say
  bool has_centre = false;  ///< of mass, which MovingBody then has
  bool has_inertia = false;
  bool driven = false;  ///< something else than contacts moves it
};

/// A listener, such as a camera, which looks along its -z.
struct SceneListener {
  std::string name;
  std::vector<BodyPose> poses;  ///< one for each frame
};

/// The content of a file of motions.
struct MotionScene {
  Motion motion;                  ///< masses are those of the file, zero where it has none
  std::vector<SceneBody> bodies;  ///< like motion.bodies
  std::vector<SceneListener> listeners;
};

/// Reads an animated glTF: each node with a mesh is a body, and moves if its transformation or that
/// of an ancestor does. The frame is the median distance of the keys. Mass, centre of mass, inertia
/// and friction come from KHR_physics_rigid_bodies and OMI_physics_body where a node has them.
/// Errors: NotFound (FILE_NOT_FOUND), InvalidArgument (NO_MOTION: without an animation of a node
/// with a mesh; MOTION_TOO_COARSE: keys were thinned out, unless `even_if_coarse`;
/// MOTION_MALFORMED: the file is damaged, or a body is no rigid one).
absl::StatusOr<MotionScene> ReadGltfMotion(const std::string& path, bool even_if_coarse);

/// Reads a table of poses, without surfaces: a text of the columns t, body, x, y, z, qw, qx, qy, qz
/// (.csv, seconds; a line of names gives their order), or a NumPy archive (.npz) of the arrays
/// times (F), bodies (B names), positions (F, B, 3) and orientations (F, B, 4: w, x, y, z). Errors:
/// NotFound (FILE_NOT_FOUND), InvalidArgument (MOTION_MALFORMED).
absl::StatusOr<MotionScene> ReadPoseTable(const std::string& path);

/// Reads the surface of an OBJ file. Errors: NotFound (FILE_NOT_FOUND), InvalidArgument
/// (MOTION_MALFORMED).
absl::StatusOr<BodySurface> ReadObjSurface(const std::string& path);

/// The surface as the text of an OBJ file.
std::string ObjText(const BodySurface& surface);

/// Volume, centre and second moments of the solid within a closed surface.
struct SolidMeasures {
  double volume_m3 = 0, area_m2 = 0;
  Vector centre_m = Vector::Zero();
  Matrix inertia_per_kg = Matrix::Zero();  ///< about the centre, m^2
};
SolidMeasures Measure(const BodySurface& surface);

/// True if each edge has two triangles that run along it in opposite directions.
bool IsClosed(const BodySurface& surface);

/// Turns the triangles of a closed surface whose normals point inward, so that its volume is
/// positive.
void TurnOutward(BodySurface& surface);

}  // namespace carillon::motion
