// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/read_mesh.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/read/elements/gmsh_file.h"
#include "precompute/mesh/read/elements/inp_file.h"
#include "precompute/mesh/read/elements/medit_file.h"
#include "precompute/mesh/read/elements/tetgen_file.h"
#include "precompute/mesh/read/far_origin.h"
#include "precompute/mesh/read/make_mesh.h"
#include "precompute/mesh/read/read_surface.h"
#include "precompute/mesh/read/text/text_encoding.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/mesh_format.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

void Scale(Point& p, double factor) {
  for (double& x : p) x *= factor;
}

void Scale(NamedMesh& named, double factor) {
  for (Point& p : named.points()) Scale(p, factor);
  for (auto& [number, p] : named.names.vertices) Scale(p, factor);
  Scale(named.names.origin_m, factor);
}

/// Moves a body that lies too far from the origin for the stored model, and says so.
void MoveNear(NamedMesh& named) {
  if (named.names.origin_m == Point{0, 0, 0} && !named.points().empty()) {
    CountFrom(FarOrigin(named.points()), named);
  }
  const Point& origin = named.names.origin_m;
  if (origin == Point{0, 0, 0}) return;
  named.warnings.push_back(absl::StrFormat(
      "the body lies so far from the origin that single precision does not resolve it; the places "
      "of the model are counted from (%.15g, %.15g, %.15g) m, fixtures from the file's origin",
      origin[0], origin[1], origin[2]));
}

/// Whether lines end by a carriage return alone, as those of old editors of the Macintosh and the
/// headers of old binary PLY do.
bool EndsLinesByReturn(const std::string& bytes) {
  if (bytes.starts_with("ply\r")) return !bytes.starts_with("ply\r\n");
  return bytes.find('\n') == std::string::npos && bytes.find('\r') != std::string::npos &&
         bytes.find('\0') == std::string::npos;
}

/// Returns the text of a file whose characters or ends of lines no reader expects, and nothing if
/// the bytes can be read as they are.
std::optional<std::string> PlainText(const std::string& bytes) {
  std::optional<std::string> text = Utf8OfUtf16(bytes);
  const std::string_view unmarked = WithoutByteOrderMark(bytes);
  if (!text && unmarked.size() < bytes.size()) text = std::string(unmarked);
  const std::string& now = text ? *text : bytes;
  if (!EndsLinesByReturn(now)) return text;
  std::string lines = now;
  const bool is_binary = lines.find("\rformat binary") != std::string::npos;
  const size_t header = lines.find("\rend_header\r");
  const size_t end = is_binary && header != std::string::npos ? header + 12 : lines.size();
  std::replace(lines.begin(), lines.begin() + static_cast<ptrdiff_t>(end), '\r', '\n');
  return lines;
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
  absl::StatusOr<NamedMesh> named = MakeMesh(std::move(file));
  if (named.ok()) return named;
  absl::Status refusal = named.status();
  AddFigure(refusal, "repair_helps", "0");  // surfaces alone are repaired
  return refusal;
}

}  // namespace

absl::StatusOr<NamedMesh> ParseMesh(const std::string& bytes, const std::string& format,
                                    double metres_per_unit) {
  const MeshFormat* known = FindMeshFormat(format);
  if (known == nullptr) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_FORMAT_UNKNOWN",
        absl::StrCat("there is no mesh format ", QuotedText(format), ": give ", MeshFormatNames()));
  }
  const std::optional<std::string> text = PlainText(bytes);
  const std::string& content = text ? *text : bytes;
  ASSIGN_OR_RETURN(NamedMesh named, known->is_surface ? ReadSurface(content, format)
                                                      : ReadElements(content, format));
  Scale(named, metres_per_unit);
  MoveNear(named);
  return named;
}

absl::StatusOr<NamedMesh> ReadMesh(const std::string& path, const std::string& format,
                                   double metres_per_unit) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadMeshFile(path, format));
  return ParseMesh(bytes, format, metres_per_unit);
}

}  // namespace carillon::precompute
