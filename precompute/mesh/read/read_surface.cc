// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/read_surface.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "precompute/mesh/read/clean_surface_file.h"
#include "precompute/mesh/read/merge_vertices.h"
#include "precompute/mesh/read/obj_groups.h"
#include "precompute/mesh/read/text_lines.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Triangles = std::vector<std::array<Point, 3>>;

/// A file of 256 MiB can list about 10 million triangles, but a small glTF can place a part any
/// number of times.
constexpr size_t kMostTriangles = 20'000'000;

/// Opens no file. A glTF can name files beside its own, and a client of the daemon must not have
/// them read.
class NoFiles final : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*file*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*file*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*stream*/) override {}
};

absl::Status RefuseSurface(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

absl::Status Unreadable(absl::string_view format, absl::string_view what) {
  // assimp names a file of its own for bytes in memory, and ends some messages with a full stop.
  const std::string all =
      absl::StrReplaceAll(what, {{absl::StrCat(AI_MEMORYIO_MAGIC_FILENAME, ".", format), "it"}});
  absl::string_view reason = all;
  while (absl::ConsumeSuffix(&reason, ".")) {
  }
  return RefuseSurface("MESH_UNREADABLE",
                       absl::StrCat("the file cannot be read as ", format, ": ", reason,
                                    ". Name its right format, or export it again"));
}

/// Returns why assimp could not read a file.
absl::Status NotRead(const std::string& format, const std::string& bytes, absl::string_view error) {
  const std::string missing = format == "gltf" ? ExternalBuffer(bytes) : "";
  if (missing.empty()) return Unreadable(format, error);
  return RefuseSurface(
      "MESH_UNREADABLE",
      absl::StrCat("the glTF keeps its data in another file, \"", absl::CHexEscape(missing),
                   "\", which did not come with it: export the body as GLB, or "
                   "name the .gltf file itself to Carillon's programs"));
}

std::span<aiMesh* const> Meshes(const aiScene& scene) { return {scene.mMeshes, scene.mNumMeshes}; }

std::span<const aiFace> Faces(const aiMesh& mesh) { return {mesh.mFaces, mesh.mNumFaces}; }

/// assimp passes on faces of a PLY file as they are; its own steps would read past the vertices,
/// and abort at a face without any.
absl::Status CheckIndices(const aiScene& scene) {
  size_t face_number = 0;
  for (const aiMesh* mesh : Meshes(scene)) {
    for (const aiFace& face : Faces(*mesh)) {
      if (face.mNumIndices == 0) {
        return RefuseSurface("MESH_UNREADABLE",
                             absl::StrCat("face ", face_number,
                                          " (counted from zero) names no vertices: export the mesh "
                                          "again"));
      }
      for (const unsigned index : std::span(face.mIndices, face.mNumIndices)) {
        if (index < mesh->mNumVertices) continue;
        return RefuseSurface("MESH_INDEX_OUT_OF_RANGE",
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
        return RefuseSurface(
            "MESH_NOT_FINITE",
            absl::StrCat("vertex ", vertex_number, " (counted from zero) lies at (", p.x, ", ", p.y,
                         ", ", p.z, "): give it finite coordinates"));
      }
      ++vertex_number;
    }
  }
  return absl::OkStatus();
}

/// Only glTF places the parts of a body in a scene, each any number of times.
bool IsGltf(const std::string& format) { return format == "glb" || format == "gltf"; }

/// Triangles that the polygons of a mesh must give.
size_t CountTriangles(const aiMesh& mesh) {
  size_t count = 0;
  for (const aiFace& face : Faces(mesh)) {
    if (face.mNumIndices >= 3) count += face.mNumIndices - 2;
  }
  return count;
}

/// Triangles that all polygons must give.
size_t CountTriangles(const aiScene& scene, bool with_places) {
  std::vector<size_t> counts;
  for (const aiMesh* mesh : Meshes(scene)) counts.push_back(CountTriangles(*mesh));
  if (!with_places) return std::accumulate(counts.begin(), counts.end(), size_t{0});
  size_t count = 0;
  std::vector<const aiNode*> waiting = {scene.mRootNode};
  while (!waiting.empty()) {
    const aiNode& node = *waiting.back();
    waiting.pop_back();
    for (const unsigned mesh : std::span(node.mMeshes, node.mNumMeshes)) count += counts[mesh];
    waiting.insert(waiting.end(), node.mChildren, node.mChildren + node.mNumChildren);
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

/// The first three numbers of a line as assimp keeps them, in 24 bits.
Point ToPoint(std::span<const std::string_view> words) {
  Point p{};
  for (size_t i = 0; i < 3; ++i) p[i] = static_cast<float>(ToNumber<double>(words[i]).value_or(0));
  return p;
}

/// Vertices in the order of the file; assimp changes them for OBJ and OFF files but not for PLY.
absl::flat_hash_map<int64_t, Point> NumberVertices(const aiScene& scene, const std::string& clean,
                                                   const std::string& format) {
  absl::flat_hash_map<int64_t, Point> vertices;
  const auto add = [&](const Point& p) { vertices[static_cast<int64_t>(vertices.size())] = p; };
  if (format == "ply") {
    for (const aiVector3D& p :
         std::span(scene.mMeshes[0]->mVertices, scene.mMeshes[0]->mNumVertices)) {
      add({p.x, p.y, p.z});
    }
  }
  TextLines lines(clean);
  if (format == "obj") {
    for (auto words = lines.NextWords(); !words.empty() && words[0] == "v";
         words = lines.NextWords()) {
      add(ToPoint(std::span(words).subspan(1)));
    }
  }
  if (format == "off") {
    lines.NextWords();
    const size_t count = ToNumber<size_t>(lines.NextWords()[0]).value_or(0);
    while (vertices.size() < count) add(ToPoint(lines.NextWords()));
  }
  return vertices;
}

}  // namespace

absl::StatusOr<NamedMesh> ReadSurface(const std::string& bytes, const std::string& format) {
  ASSIGN_OR_RETURN(const std::string clean, CleanSurfaceFile(bytes, format));
  Assimp::Importer importer;
  importer.SetIOHandler(new NoFiles);  // the importer owns it
  const aiScene* scene = importer.ReadFileFromMemory(clean.data(), clean.size(), 0, format.c_str());
  if (scene == nullptr) return NotRead(format, clean, importer.GetErrorString());
  RETURN_IF_ERROR(CheckIndices(*scene));
  RETURN_IF_ERROR(CheckFinite(*scene));
  const size_t expected = CountTriangles(*scene, IsGltf(format));
  if (expected > kMostTriangles) {
    return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                   absl::StrCat("the scene of the file has ", expected, " triangles, more than ",
                                kMostTriangles, ": simplify it, or leave out parts"));
  }
  if (expected == 0) {
    return RefuseSurface("MESH_EMPTY",
                         "the file has no faces: export the body as triangles or polygons");
  }
  MeshNames names;
  names.vertices = NumberVertices(*scene, clean, format);
  const unsigned place = IsGltf(format) ? unsigned{aiProcess_PreTransformVertices} : 0;
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate | place);
  if (scene == nullptr) return Unreadable(format, importer.GetErrorString());
  const Triangles triangles = CollectTriangles(*scene);
  if (triangles.size() != expected) {
    return Unreadable(format, absl::StrCat("its polygons give ", triangles.size(), " triangles of ",
                                           expected, "; export triangles instead"));
  }
  names.groups = format == "obj" ? ObjGroups(bytes) : std::vector<MeshGroup>();
  return NamedMesh{MergeVertices(triangles), std::move(names)};
}

}  // namespace carillon::precompute
