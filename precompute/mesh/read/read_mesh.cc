// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/read_mesh.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/gmsh_file.h"
#include "precompute/mesh/read/inp_file.h"
#include "precompute/mesh/read/make_mesh.h"
#include "precompute/mesh/read/medit_file.h"
#include "precompute/mesh/read/read_surface.h"
#include "precompute/mesh/read/tetgen_file.h"
#include "precompute/mesh/read/text_encoding.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr size_t kMostMeshBytes = size_t{256} << 20;
constexpr size_t kReadPiece = size_t{1} << 20;

/// Reads at most `limit` bytes from the file's place on. The file may be a pipe, which knows no
/// length.
std::string ReadUpTo(std::ifstream& file, size_t limit) {
  std::string bytes;
  while (file && bytes.size() < limit) {
    const size_t read = bytes.size();
    bytes.resize(std::min(limit, read + kReadPiece));
    file.read(bytes.data() + read, static_cast<std::streamsize>(bytes.size() - read));
    bytes.resize(read + static_cast<size_t>(file.gcount()));
  }
  return bytes;
}

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes = ReadUpTo(file, kMostMeshBytes + 1);
  if (!file.is_open() || file.bad()) {
    return Refusal(absl::StatusCode::kNotFound, "MESH_FILE_NOT_READABLE",
                   absl::StrCat(path,
                                " cannot be read: check that it is a file, its name and its "
                                "permissions"));
  }
  if (bytes.size() > kMostMeshBytes) {
    return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                   absl::StrCat(path, " has more than 256 MiB: simplify the body's surface"));
  }
  if (bytes.empty()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                   "the mesh file has no bytes: export the body again");
  }
  return bytes;
}

void Scale(Point& p, double factor) {
  for (double& x : p) x *= factor;
}

void Scale(NamedMesh& named, double factor) {
  auto* surface = std::get_if<SurfaceMesh>(&named.mesh);
  auto& points = surface != nullptr ? surface->vertices : std::get<TetMesh>(named.mesh).nodes;
  for (Point& p : points) Scale(p, factor);
  for (auto& [number, p] : named.names.vertices) Scale(p, factor);
}

absl::StatusOr<ElementFile> ParseElements(const std::string& bytes, const std::string& format) {
  if (format == "msh") return ParseGmsh(bytes);
  if (format == "inp") return ParseInp(bytes);
  if (format == "mesh") return ParseMedit(bytes);
  if (format == "node") return ParseTetgen(bytes);
  return absl::InternalError(absl::StrCat("no reader of elements for the format ", format));
}

absl::StatusOr<NamedMesh> ReadElements(const std::string& bytes, const std::string& format) {
  ASSIGN_OR_RETURN(ElementFile file, ParseElements(bytes, format));
  return MakeMesh(std::move(file));
}

}  // namespace

absl::StatusOr<std::string> ReadMeshFile(const std::string& path, const std::string& format) {
  const std::filesystem::path file(path);
  if (format != "node" || (file.extension() != ".node" && file.extension() != ".ele")) {
    return ReadFile(path);
  }
  ASSIGN_OR_RETURN(std::string nodes,
                   ReadFile(std::filesystem::path(file).replace_extension(".node")));
  const std::filesystem::path elements = std::filesystem::path(file).replace_extension(".ele");
  // They may stand in one file already.
  if (!std::filesystem::exists(elements)) return nodes;
  ASSIGN_OR_RETURN(const std::string rest, ReadFile(elements));
  return absl::StrCat(nodes, nodes.ends_with('\n') ? "" : "\n", rest);
}

absl::StatusOr<NamedMesh> ParseMesh(const std::string& bytes, const std::string& format,
                                    double metres_per_unit) {
  const MeshFormat* known = FindMeshFormat(format);
  if (known == nullptr) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
        absl::StrCat("there is no mesh format \"", format, "\": give ", MeshFormatNames()));
  }
  const std::optional<std::string> text = Utf8OfUtf16(bytes);
  const std::string& content = text ? *text : bytes;
  ASSIGN_OR_RETURN(NamedMesh named, known->is_surface ? ReadSurface(content, format)
                                                      : ReadElements(content, format));
  Scale(named, metres_per_unit);
  return named;
}

absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadMeshFile(path, format));
  return ParseMesh(bytes, format, metres_per_unit);
}

}  // namespace carillon::precompute
