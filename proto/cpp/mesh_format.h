// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace carillon {

/// A format of mesh files, as CreateModalModelRequest.mesh_format names it.
struct MeshFormat {
  std::string_view name;  ///< also the suffix of its files
  bool is_surface;        ///< has triangles only; if false, tetrahedra or triangles
  /// Typical number of bytes of a file for each vertex, from which memory is predicted before the
  /// file is read.
  double bytes_per_vertex;
};

/// Every format that carillon-precompute reads. For each vertex, a closed surface has two
/// triangles, and a solid has about five tetrahedra. The sizes assume that OBJ and glTF are text,
/// and that PLY, STL, OFF and GLB are binary.
inline constexpr std::array kMeshFormats = std::to_array<MeshFormat>({
    {.name = "obj", .is_surface = true, .bytes_per_vertex = 90},
    {.name = "ply", .is_surface = true, .bytes_per_vertex = 60},
    {.name = "stl", .is_surface = true, .bytes_per_vertex = 100},
    {.name = "off", .is_surface = true, .bytes_per_vertex = 60},
    {.name = "glb", .is_surface = true, .bytes_per_vertex = 60},
    {.name = "gltf", .is_surface = true, .bytes_per_vertex = 90},
    {.name = "msh", .is_surface = false, .bytes_per_vertex = 250},
    {.name = "mesh", .is_surface = false, .bytes_per_vertex = 250},
    {.name = "node", .is_surface = false, .bytes_per_vertex = 250},
    {.name = "inp", .is_surface = false, .bytes_per_vertex = 250},
});

/// Returns the format of that name, or null if there is none.
const MeshFormat* FindMeshFormat(std::string_view name);

/// Returns the names of all formats: "obj, ply, ... or inp".
std::string MeshFormatNames();

}  // namespace carillon
