// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "client_sdk/motion/files/motion_scene.h"
#include "proto/cpp/gltf/gltf_document.h"
#include "proto/cpp/gltf/gltf_nodes.h"
#include "proto/cpp/gltf/gltf_surface.h"

namespace carillon::motion {

/// Returns a member of an object, or null if there is none.
const nlohmann::json& Member(const nlohmann::json& object, const char* key);

/// Adds the triangles of a primitive to a surface. Exporters give a corner once for each of its
/// normals: corners at one place are one.
void AddSurface(const GltfSurface& from, BodySurface& to);

/// Reads what KHR_physics_rigid_bodies and OMI_physics_body say of a node: mass, centre of mass,
/// inertia, friction, whether it is driven, the dampings (`motion.extras.linearDamping` and
/// `angularDamping`, shares of the velocities that are lost in a second), and the mesh that it
/// collides (`collider.geometry.mesh`, with `collider.extras.rounding`, its radius of rounding).
/// `world` is the node's matrix. Throws a fault of glTF.
void ReadGltfPhysics(const GltfDocument& document, const nlohmann::json& node,
                     const GltfMatrix& world, MovingBody& body, SceneBody& about);

}  // namespace carillon::motion
