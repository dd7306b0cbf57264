// SPDX-License-Identifier: AGPL-3.0-or-later
#include "tests/precompute/mesh/mesh_files.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace carillon::precompute {
namespace {

constexpr int kFirstNodeNumber = 11;

std::string Coordinates(const Point& p) {
  return absl::StrFormat("%.9g %.9g %.9g", p[0], p[1], p[2]);
}

template <typename T>
void Append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

const Point& Corner(const SurfaceMesh& surface, const std::array<int32_t, 3>& triangle, size_t i) {
  return surface.vertices[static_cast<size_t>(triangle[i])];
}

std::string PlyHeader(const SurfaceMesh& surface, const std::string& format) {
  return absl::StrCat(
      "ply\nformat ", format, " 1.0\ncomment of a test\nelement vertex ", surface.vertices.size(),
      "\nproperty float x\nproperty float y\nproperty float z\nelement face ",
      surface.triangles.size(), "\nproperty list uchar int vertex_indices\nend_header\n");
}

/// Node numbers of an element in Gmsh's order.
std::vector<int32_t> GmshNodes(const TetMesh& mesh, size_t e) {
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  std::vector<int32_t> nodes(&mesh.elements[e * stride], &mesh.elements[e * stride] + stride);
  if (stride == 10) std::swap(nodes[8], nodes[9]);
  for (int32_t& node : nodes) node += kFirstNodeNumber;
  return nodes;
}

/// Numbers as MSH 4.1 has them: text, or bytes.
class Figures {
 public:
  explicit Figures(bool is_binary) : is_binary_(is_binary) {}

  template <typename T>
  void Put(T value) {
    if (is_binary_) {
      Append(bytes, value);
    } else if constexpr (std::is_same_v<T, double>) {
      absl::StrAppendFormat(&bytes, " %.17g", value);
    } else {
      absl::StrAppend(&bytes, " ", value);
    }
  }
  void EndLine() {
    if (!is_binary_) bytes += '\n';
  }
  template <typename... T>
  void PutLine(T... values) {
    (Put(values), ...);
    EndLine();
  }

  std::string bytes;

 private:
  bool is_binary_;
};

void PutEntities(Figures& out) {
  const uint64_t none = 0, one = 1, two = 2;
  out.PutLine(one, none, one, one);
  out.PutLine(3, 0.0, 0.0, 0.0, none);
  out.PutLine(6, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, two, 8, -5, one, 3);
  out.PutLine(1, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, one, 7, one, 6);
}

void PutNodes(const TetMesh& mesh, Figures& out) {
  const size_t on_surface = mesh.nodes.size() / 2;
  out.PutLine(uint64_t{2}, mesh.nodes.size(), uint64_t{kFirstNodeNumber},
              kFirstNodeNumber + mesh.nodes.size() - 1);
  for (const bool surface : {true, false}) {
    const size_t first = surface ? 0 : on_surface;
    const size_t last = surface ? on_surface : mesh.nodes.size();
    out.PutLine(surface ? 2 : 3, surface ? 6 : 1, surface ? 1 : 0, last - first);
    for (size_t n = first; n < last; ++n) out.Put(uint64_t{n + kFirstNodeNumber});
    out.EndLine();
    for (size_t n = first; n < last; ++n) {
      for (const double x : mesh.nodes[n]) out.Put(x);
      surface ? out.PutLine(0.5, 0.25) : out.EndLine();
    }
  }
}

void PutElements(const TetMesh& mesh, Figures& out) {
  uint64_t number = 1;
  const size_t count = mesh.boundary.size() + mesh.element_count();
  out.PutLine(uint64_t{2}, count, number, count);
  out.PutLine(2, 6, 2, mesh.boundary.size());
  for (const BoundaryFace& face : mesh.boundary) {
    out.Put(number++);
    for (size_t i = 0; i < 3; ++i) {
      out.Put(static_cast<uint64_t>(face.nodes[i]) + kFirstNodeNumber);
    }
    out.EndLine();
  }
  out.PutLine(3, 1, mesh.nodes_per_element == 10 ? 11 : 4, mesh.element_count());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    out.Put(number++);
    for (const int32_t node : GmshNodes(mesh, e)) out.Put(static_cast<uint64_t>(node));
    out.EndLine();
  }
}

std::string ToGmsh41(const TetMesh& mesh, bool is_binary) {
  std::string file = is_binary ? "$MeshFormat\n4.1 1 8\n" : "$MeshFormat\n4.1 0 8\n";
  if (is_binary) {
    Append(file, int32_t{1});
    file += '\n';
  }
  absl::StrAppend(&file, "$EndMeshFormat\n$PhysicalNames\n2\n2 8 \"skin\"\n3 7 \"body\"\n",
                  "$EndPhysicalNames\n");
  for (const char* section : {"Entities", "Nodes", "Elements"}) {
    Figures figures(is_binary);
    if (section[0] == 'N') PutNodes(mesh, figures);
    if (section[1] == 'n') PutEntities(figures);
    if (section[1] == 'l') PutElements(mesh, figures);
    absl::StrAppend(&file, "$", section, "\n", figures.bytes, "\n$End", section, "\n");
  }
  return file;
}

int GmshType(const TetMesh& mesh) { return mesh.nodes_per_element == 10 ? 11 : 4; }

}  // namespace

std::string ToObj(const SurfaceMesh& surface) {
  std::string text = "# of a test\n";
  for (const Point& p : surface.vertices) absl::StrAppend(&text, "v ", Coordinates(p), "\n");
  for (const auto& [a, b, c] : surface.triangles) {
    absl::StrAppend(&text, "f ", a + 1, " ", b + 1, " ", c + 1, "\n");
  }
  return text;
}

std::string ToOff(const SurfaceMesh& surface) {
  std::string text = absl::StrCat("OFF\n# of a test\n", surface.vertices.size(), " ",
                                  surface.triangles.size(), " 0\n");
  for (const Point& p : surface.vertices) absl::StrAppend(&text, Coordinates(p), "\n");
  for (const auto& triangle : surface.triangles) {
    absl::StrAppend(&text, "3 ", absl::StrJoin(triangle, " "), "\n");
  }
  return text;
}

std::string ToTextPly(const SurfaceMesh& surface) {
  std::string text = PlyHeader(surface, "ascii");
  for (const Point& p : surface.vertices) absl::StrAppend(&text, Coordinates(p), "\n");
  for (const auto& triangle : surface.triangles) {
    absl::StrAppend(&text, "3 ", absl::StrJoin(triangle, " "), "\n");
  }
  return text;
}

std::string ToBinaryPly(const SurfaceMesh& surface) {
  std::string bytes = PlyHeader(surface, "binary_little_endian");
  for (const Point& p : surface.vertices) {
    for (const double x : p) Append(bytes, static_cast<float>(x));
  }
  for (const auto& triangle : surface.triangles) {
    Append(bytes, uint8_t{3});
    for (const int32_t v : triangle) Append(bytes, v);
  }
  return bytes;
}

std::string ToTextStl(const SurfaceMesh& surface) {
  std::string text = "solid test\n";
  for (const auto& triangle : surface.triangles) {
    absl::StrAppend(&text, "facet normal 0 0 0\nouter loop\n");
    for (size_t i = 0; i < 3; ++i) {
      absl::StrAppend(&text, "vertex ", Coordinates(Corner(surface, triangle, i)), "\n");
    }
    absl::StrAppend(&text, "endloop\nendfacet\n");
  }
  return text + "endsolid test\n";
}

std::string ToBinaryStl(const SurfaceMesh& surface) {
  std::string bytes(80, '\0');
  Append(bytes, static_cast<uint32_t>(surface.triangles.size()));
  for (const auto& triangle : surface.triangles) {
    for (int i = 0; i < 3; ++i) Append(bytes, 0.0F);  // normal
    for (size_t i = 0; i < 3; ++i) {
      for (const double x : Corner(surface, triangle, i)) Append(bytes, static_cast<float>(x));
    }
    Append(bytes, uint16_t{0});
  }
  return bytes;
}

std::string ToTextGmsh(const TetMesh& mesh) {
  std::string text = absl::StrCat(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n"
      "3 7 \"body\"\n$EndPhysicalNames\n$Nodes\n",
      mesh.nodes.size(), "\n");
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    absl::StrAppendFormat(&text, "%d %.17g %.17g %.17g\n", static_cast<int>(n) + kFirstNodeNumber,
                          p[0], p[1], p[2]);
  }
  absl::StrAppend(&text, "$EndNodes\n$Elements\n", mesh.boundary.size() + mesh.element_count(),
                  "\n");
  int number = 1;
  for (const BoundaryFace& face : mesh.boundary) {
    absl::StrAppend(&text, number++, " 2 2 5 6 ", face.nodes[0] + kFirstNodeNumber, " ",
                    face.nodes[1] + kFirstNodeNumber, " ", face.nodes[2] + kFirstNodeNumber, "\n");
  }
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    absl::StrAppend(&text, number++, " ", GmshType(mesh), " 2 7 1 ",
                    absl::StrJoin(GmshNodes(mesh, e), " "), "\n");
  }
  return text + "$EndElements\n";
}

std::string ToBinaryGmsh(const TetMesh& mesh) {
  std::string bytes = "$MeshFormat\n2.2 1 8\n";
  Append(bytes, int32_t{1});
  absl::StrAppend(&bytes, "\n$EndMeshFormat\n$Nodes\n", mesh.nodes.size(), "\n");
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    Append(bytes, static_cast<int32_t>(n) + kFirstNodeNumber);
    for (const double x : mesh.nodes[n]) Append(bytes, x);
  }
  absl::StrAppend(&bytes, "\n$EndNodes\n$Elements\n", mesh.boundary.size() + mesh.element_count(),
                  "\n");
  int32_t number = 1;
  for (const int32_t figure : {2, static_cast<int32_t>(mesh.boundary.size()), 2})
    Append(bytes, figure);
  for (const BoundaryFace& face : mesh.boundary) {
    for (const int32_t figure : {number++, 5, 6}) Append(bytes, figure);
    for (size_t i = 0; i < 3; ++i) Append(bytes, face.nodes[i] + kFirstNodeNumber);
  }
  const auto count = static_cast<int32_t>(mesh.element_count());
  for (const int32_t figure : {GmshType(mesh), count, 2}) Append(bytes, figure);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const int32_t figure : {number++, 7, 1}) Append(bytes, figure);
    for (const int32_t node : GmshNodes(mesh, e)) Append(bytes, node);
  }
  return bytes + "\n$EndElements\n";
}

std::string ToTextGmsh41(const TetMesh& mesh) { return ToGmsh41(mesh, false); }
std::string ToBinaryGmsh41(const TetMesh& mesh) { return ToGmsh41(mesh, true); }

std::string ToMedit(const TetMesh& mesh) {
  const bool quadratic = mesh.nodes_per_element == 10;
  std::string text = absl::StrCat("MeshVersionFormatted 2 # of a test\nDimension\n3\n\nVertices\n",
                                  mesh.nodes.size(), "\n");
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    absl::StrAppendFormat(&text, "%.17g %.17g %.17g %d\n", p[0], p[1], p[2], n == 0 ? 9 : 5);
  }
  absl::StrAppend(&text, "Corners\n1\n1\n", quadratic ? "TrianglesP2\n" : "Triangles\n",
                  mesh.boundary.size(), "\n");
  for (const BoundaryFace& face : mesh.boundary) {
    for (size_t i = 0; i < (quadratic ? 6U : 3U); ++i) {
      absl::StrAppend(&text, face.nodes[i] + 1, " ");
    }
    text += "5\n";
  }
  absl::StrAppend(&text, quadratic ? "TetrahedraP2 " : "Tetrahedra ", mesh.element_count(), "\n");
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t i = 0; i < stride; ++i) {
      absl::StrAppend(&text, mesh.elements[e * stride + i] + 1, " ");
    }
    text += "1\n";
  }
  return text + "End\n";
}

std::string ToInp(const TetMesh& mesh) {
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  std::string text = "*Heading\n of a test\n** Nodes\n*NODE\n";
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    absl::StrAppendFormat(&text, "%d, %.17g, %.17g,%.17g\n", static_cast<int>(n) + 11, p[0], p[1],
                          p[2]);
  }
  absl::StrAppend(&text, "*Element, type=", stride == 10 ? "STRI65" : "S3R", ", ELSET=skin\n");
  size_t number = 0;
  for (const BoundaryFace& face : mesh.boundary) {
    absl::StrAppend(&text, ++number);
    for (const int32_t node : face.nodes) {
      if (node >= 0) absl::StrAppend(&text, ", ", node + 11);
    }
    text += '\n';
  }
  absl::StrAppend(&text, "*ELEMENT,\n TYPE=C3D", stride, ", ELSET=\"the body\"\n");
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    absl::StrAppend(&text, ++number);
    for (size_t i = 0; i < stride; ++i) {
      absl::StrAppend(&text, i == 2 ? ",\n " : ",", mesh.elements[e * stride + i] + 11);
    }
    text += '\n';
  }
  return text + "*NSET, NSET=tip\n11\n*ELSET, ELSET=two, GENERATE\n1, 2, 1\n*SOLID SECTION\n1.,\n";
}

std::string ToTetgen(const TetMesh& mesh, int first) {
  const auto stride = static_cast<size_t>(mesh.nodes_per_element);
  std::string text = absl::StrCat("# of a test\n", mesh.nodes.size(), " 3 1 1\n");
  for (size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Point& p = mesh.nodes[n];
    absl::StrAppendFormat(&text, "%d  %.17g %.17g %.17g  0.5 %d\n", static_cast<int>(n) + first,
                          p[0], p[1], p[2], n < 2 ? 5 : 0);
  }
  absl::StrAppend(&text, "# its elements\n", mesh.element_count(), " ", stride, " 1\n");
  // The mid-side nodes of edges 2-3, 0-3, 0-1, 1-2, 1-3 and 0-2.
  constexpr std::array<size_t, 10> kOrder = {0, 1, 2, 3, 9, 7, 4, 5, 8, 6};
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    absl::StrAppend(&text, e + static_cast<size_t>(first));
    for (size_t i = 0; i < stride; ++i) {
      absl::StrAppend(&text, " ", mesh.elements[e * stride + kOrder[i]] + first);
    }
    text += " 0.25\n";
  }
  return text;
}

}  // namespace carillon::precompute
