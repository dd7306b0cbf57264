// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read_surface.h"

#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/clean_surface_file.h"
#include "precompute/mesh/merge_vertices.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

using Triangles = std::vector<std::array<Point, 3>>;

absl::Status Refuse(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

absl::Status Unreadable(absl::string_view format, absl::string_view what) {
  return Refuse("MESH_UNREADABLE", absl::StrCat("the file cannot be read as ", format, ": ", what,
                                                ". Name its right format, or export it again"));
}

std::span<aiMesh* const> Meshes(const aiScene& scene) { return {scene.mMeshes, scene.mNumMeshes}; }

std::span<const aiFace> Faces(const aiMesh& mesh) { return {mesh.mFaces, mesh.mNumFaces}; }

/// assimp passes on indices of a PLY file as they are; its own steps would read past the vertices.
absl::Status CheckIndices(const aiScene& scene) {
  size_t face_number = 0;
  for (const aiMesh* mesh : Meshes(scene)) {
    for (const aiFace& face : Faces(*mesh)) {
      for (const unsigned index : std::span(face.mIndices, face.mNumIndices)) {
        if (index < mesh->mNumVertices) continue;
        return Refuse("MESH_INDEX_OUT_OF_RANGE",
                      absl::StrCat("face ", face_number, " names vertex ",
                                   static_cast<int32_t>(index), " of ", mesh->mNumVertices,
                                   " (counted from zero): export the mesh again"));
      }
      ++face_number;
    }
  }
  return absl::OkStatus();
}

absl::Status CheckFinite(const aiScene& scene) {
  size_t vertex_number = 0;
  for (const aiMesh* mesh : Meshes(scene)) {
    for (const aiVector3D& p : std::span(mesh->mVertices, mesh->mNumVertices)) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
        return Refuse("MESH_NOT_FINITE",
                      absl::StrCat("vertex ", vertex_number, " (counted from zero) lies at (", p.x,
                                   ", ", p.y, ", ", p.z, "): give it finite coordinates"));
      }
      ++vertex_number;
    }
  }
  return absl::OkStatus();
}

/// Triangles that the polygons of the file must give.
size_t CountTriangles(const aiScene& scene) {
  size_t count = 0;
  for (const aiMesh* mesh : Meshes(scene)) {
    for (const aiFace& face : Faces(*mesh)) {
      if (face.mNumIndices >= 3) count += face.mNumIndices - 2;
    }
  }
  return count;
}

Triangles CollectTriangles(const aiScene& scene) {
  Triangles triangles;
  for (const aiMesh* mesh : Meshes(scene)) {
    for (const aiFace& face : Faces(*mesh)) {
      if (face.mNumIndices != 3) continue;  // points and lines bound nothing
      auto& corners = triangles.emplace_back();
      for (size_t i = 0; i < 3; ++i) {
        const aiVector3D& p = mesh->mVertices[face.mIndices[i]];
        corners[i] = {p.x, p.y, p.z};
      }
    }
  }
  return triangles;
}

}  // namespace

absl::StatusOr<SurfaceMesh> ReadSurface(std::string bytes, const std::string& format) {
  const absl::StatusOr<std::string> clean = CleanSurfaceFile(std::move(bytes), format);
  if (!clean.ok()) return clean.status();
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFileFromMemory(clean->data(), clean->size(), 0, format.c_str());
  if (scene == nullptr) return Unreadable(format, importer.GetErrorString());
  if (absl::Status status = CheckIndices(*scene); !status.ok()) return status;
  if (absl::Status status = CheckFinite(*scene); !status.ok()) return status;
  const size_t expected = CountTriangles(*scene);
  if (expected == 0) {
    return Refuse("MESH_EMPTY", "the file has no faces: export the body as triangles or polygons");
  }
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr) return Unreadable(format, importer.GetErrorString());
  const Triangles triangles = CollectTriangles(*scene);
  if (triangles.size() != expected) {
    return Unreadable(format, absl::StrCat("its polygons give ", triangles.size(), " triangles of ",
                                           expected, "; export triangles instead"));
  }
  return MergeVertices(triangles);
}

}  // namespace carillon::precompute
