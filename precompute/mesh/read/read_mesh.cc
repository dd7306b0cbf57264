// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/read_mesh.h"

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
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

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
