// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/fill_with_tetgen.h"

#include <tetgen.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/boundary.h"
#include "precompute/mesh/byte_stream.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/run_in_child.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr int kTetgenOutOfMemory = 1;  // what terminatetetgen throws

absl::Status Failed(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_TETRAHEDRALIZATION_FAILED",
                 absl::StrCat("the surface could not be filled with tetrahedra: ", what,
                              ". Repair parts of it that touch or nearly touch, and long thin "
                              "triangles, or give a mesh of tetrahedra (Gmsh, MSH 2.2)"));
}

/// TetGen's mesh, as the child process sends it.
struct Filling {
  int error = 0;
  std::vector<double> coordinates;       // three a node
  std::vector<int32_t> corners;          // four a tetrahedron
  std::vector<int32_t> face_corners;     // three a face
  std::vector<int32_t> given_triangles;  // one a face
  std::vector<int32_t> spaces;           // one a tetrahedron, or none
};

/// The surface without the vertices that no triangle has. TetGen would make nodes of them, and flat
/// tetrahedra where one lies in a face except for rounding.
SurfaceMesh WithoutUnusedVertices(const SurfaceMesh& given) {
  SurfaceMesh surface{{}, given.triangles};
  std::vector<int32_t> number(given.vertices.size(), -1);
  for (const auto& triangle : surface.triangles) {
    for (const int32_t v : triangle) number[static_cast<size_t>(v)] = 0;
  }
  for (size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    number[v] = static_cast<int32_t>(surface.vertices.size());
    surface.vertices.push_back(given.vertices[v]);
  }
  for (auto& triangle : surface.triangles) {
    for (int32_t& v : triangle) v = number[static_cast<size_t>(v)];
  }
  return surface;
}

void DescribeSurface(const RefinedSurface& surface, tetgenio& in) {
  const auto [vertices, triangles] = WithoutUnusedVertices(surface.surface);
  in.numberofpoints = static_cast<int>(vertices.size());
  in.pointlist = new double[vertices.size() * 3];
  std::memcpy(in.pointlist, vertices.data(), vertices.size() * sizeof(Point));
  in.numberoffacets = static_cast<int>(triangles.size());
  in.facetlist = new tetgenio::facet[triangles.size()];
  in.facetmarkerlist = new int[triangles.size()];
  for (size_t t = 0; t < triangles.size(); ++t) {
    tetgenio::facet& facet = in.facetlist[t];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    std::ranges::copy(triangles[t], facet.polygonlist[0].vertexlist);
    in.facetmarkerlist[t] = surface.given_triangle[t] + 1;  // zero means no marker
  }
}

void DescribeCavities(const std::vector<Point>& cavities, tetgenio& in) {
  if (cavities.empty()) return;
  in.numberofholes = static_cast<int>(cavities.size());
  in.holelist = new double[cavities.size() * 3];
  std::memcpy(in.holelist, cavities.data(), cavities.size() * sizeof(Point));
}

/// The request that this process fills, for TetGen's callback, which takes no data of its user.
const FillRequest* running_request = nullptr;

/// Whether TetGen shall split the tetrahedron a, b, c, d, because it is larger than the field of
/// sizes allows at its centroid.
bool IsTooLarge(double* a, double* b, double* c, double* d, double* /*lengths*/,
                double /*volume*/) {
  const auto point = [](const double* p) { return Point{p[0], p[1], p[2]}; };
  Point middle;
  for (size_t x = 0; x < 3; ++x) middle[x] = (a[x] + b[x] + c[x] + d[x]) / 4;
  const double size = running_request->relative_size.At(middle);
  return std::abs(TetVolume(point(a), point(b), point(c), point(d))) >
         running_request->max_volume * size * size * size;
}

/// Runs in the child.
std::string RunTetgen(const FillRequest& request) {
  tetgenio in, out;
  DescribeSurface(request.surface, in);
  DescribeCavities(request.cavities, in);
  // Piecewise linear complex, quality, volume bound, indices from zero, quiet; keep the surface.
  // Facets that are plane within single precision count as plane.
  std::string switches = request.keep_surface ? "pqazT1e-6QY" : "pqazT1e-6Q";
  // Radius to edge up to 3 instead of 2.
  if (request.cautious) switches = request.keep_surface ? "pq3azT1e-6QY" : "pq3azT1e-6Q";
  if (request.has_walls) switches += "A";
  tetgenbehavior behavior;
  behavior.parse_commandline(switches.data());
  if (request.relative_size.is_uniform()) {
    behavior.fixedvolume = 1;
    behavior.maxvolume = request.max_volume;
  } else {
    running_request = &request;
    in.tetunsuitable = IsTooLarge;
  }
  behavior.steinerleft = request.max_added_nodes;
  int error = 0;
  try {
    tetrahedralize(&behavior, &in, &out);
  } catch (int code) {
    error = code;
  }
  std::string bytes;
  AppendValues<int>(bytes, {&error, 1});
  AppendValues<double>(bytes, {out.pointlist, static_cast<size_t>(out.numberofpoints) * 3});
  AppendValues<int32_t>(bytes,
                        {out.tetrahedronlist, static_cast<size_t>(out.numberoftetrahedra) * 4});
  AppendValues<int32_t>(bytes, {out.trifacelist, static_cast<size_t>(out.numberoftrifaces) * 3});
  AppendValues<int32_t>(bytes, {out.trifacemarkerlist, static_cast<size_t>(out.numberoftrifaces)});
  std::vector<int32_t> spaces;
  if (request.has_walls && out.numberoftetrahedronattributes == 1) {
    spaces.assign(out.tetrahedronattributelist,
                  out.tetrahedronattributelist + out.numberoftetrahedra);
  }
  AppendValues<int32_t>(bytes, spaces);
  return bytes;
}

Filling Parse(const std::string& bytes) {
  const char* next = bytes.data();
  Filling filling;
  filling.error = TakeValues<int>(next)[0];
  filling.coordinates = TakeValues<double>(next);
  filling.corners = TakeValues<int32_t>(next);
  filling.face_corners = TakeValues<int32_t>(next);
  filling.given_triangles = TakeValues<int32_t>(next);
  filling.spaces = TakeValues<int32_t>(next);
  return filling;
}

using Corners = std::array<int32_t, 3>;
using GivenTriangles = absl::flat_hash_map<Corners, int32_t>;

Corners Sorted(Corners corners) {
  std::ranges::sort(corners);
  return corners;
}

GivenTriangles GivenTrianglesOfFaces(const Filling& filling) {
  GivenTriangles given;
  for (size_t f = 0; f < filling.given_triangles.size(); ++f) {
    const int32_t* c = &filling.face_corners[3 * f];
    given[Sorted({c[0], c[1], c[2]})] = filling.given_triangles[f] - 1;
  }
  return given;
}

std::array<Corners, 4> FacesOf(const int32_t* corners) {
  std::array<Corners, 4> faces;
  for (size_t f = 0; f < 4; ++f) {
    for (size_t i = 0; i < 3; ++i) faces[f][i] = corners[kTetFaces[f][i]];
    faces[f] = Sorted(faces[f]);
  }
  return faces;
}

/// Whether a tetrahedron is as flat as the rounding of a plane's coordinates.
bool IsFlat(const std::vector<Point>& nodes, const int32_t* corners) {
  constexpr double kFlat = 1e-6;  // volume in cubes of the longest edge
  double longest = 0;
  std::array<Point, 4> p;
  for (size_t i = 0; i < 4; ++i) p[i] = nodes[static_cast<size_t>(corners[i])];
  for (const auto& [a, b] : kTetEdges) {
    longest = std::max(longest, Distance(p[static_cast<size_t>(a)], p[static_cast<size_t>(b)]));
  }
  return TetVolume(p[0], p[1], p[2], p[3]) < kFlat * longest * longest * longest;
}

/// Removes flat tetrahedra with two faces on the boundary. The mesher puts them on faces that are
/// plane except for rounding in single precision, and they would add nodes almost without
/// stiffness. The other two faces of the tetrahedron become boundary faces.
void PeelFlatTetrahedra(TetMesh& mesh, GivenTriangles& given) {
  const size_t count = mesh.elements.size() / 4;
  std::vector<bool> flat(count);
  for (size_t e = 0; e < count; ++e) flat[e] = IsFlat(mesh.nodes, &mesh.elements[4 * e]);
  if (std::ranges::find(flat, true) == flat.end()) return;
  absl::flat_hash_map<Corners, int> use_count;
  for (size_t e = 0; e < count; ++e) {
    for (const Corners& face : FacesOf(&mesh.elements[4 * e])) ++use_count[face];
  }
  std::vector<bool> gone(count, false);
  for (bool again = true; again;) {
    again = false;
    for (size_t e = 0; e < count; ++e) {
      if (gone[e] || !flat[e]) continue;
      const std::array<Corners, 4> faces = FacesOf(&mesh.elements[4 * e]);
      const auto outer = [&](const Corners& face) { return use_count[face] == 1; };
      if (std::ranges::count_if(faces, outer) != 2) continue;
      const auto found = given.find(*std::ranges::find_if(faces, outer));
      const int32_t triangle = found == given.end() ? -1 : found->second;
      for (const Corners& face : faces) {
        if (!outer(face)) given.try_emplace(face, triangle);
      }
      for (const Corners& face : faces) --use_count[face];
      gone[e] = again = true;
    }
  }
  std::vector<int32_t> kept, regions;
  for (size_t e = 0; e < count; ++e) {
    if (gone[e]) continue;
    kept.insert(kept.end(), &mesh.elements[4 * e], &mesh.elements[4 * e] + 4);
    if (!mesh.regions.empty()) regions.push_back(mesh.regions[e]);
  }
  mesh.elements = std::move(kept);
  mesh.regions = std::move(regions);
}

absl::Status NameGivenTriangles(const GivenTriangles& given, TetMesh& mesh) {
  for (BoundaryFace& face : mesh.boundary) {
    const auto found = given.find(Sorted({face.nodes[0], face.nodes[1], face.nodes[2]}));
    if (found == given.end() || found->second < 0) {
      return Failed("a face of its boundary lies on no triangle");
    }
    face.given_triangle = found->second;
  }
  return absl::OkStatus();
}

absl::StatusOr<TetMesh> MakeMesh(const Filling& filling) {
  if (filling.error == kTetgenOutOfMemory) {
    return Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                   "filling the surface took more memory than allowed: give a coarser surface");
  }
  if (filling.error != 0) return Failed(absl::StrCat("TetGen reports error ", filling.error));
  if (filling.corners.empty()) return Failed("nothing is inside");
  TetMesh mesh;
  mesh.nodes.resize(filling.coordinates.size() / 3);
  std::memcpy(mesh.nodes.data(), filling.coordinates.data(),
              filling.coordinates.size() * sizeof(double));
  mesh.elements = filling.corners;
  mesh.regions = filling.spaces;
  GivenTriangles given = GivenTrianglesOfFaces(filling);
  PeelFlatTetrahedra(mesh, given);
  RETURN_IF_ERROR(FindBoundary(mesh));
  RETURN_IF_ERROR(NameGivenTriangles(given, mesh));
  return mesh;
}

}  // namespace

absl::StatusOr<TetMesh> FillWithTetgen(const FillRequest& request) {
  const absl::StatusOr<std::string> bytes =
      RunInChild([&] { return RunTetgen(request); }, request.most_cpu);
  if (!bytes.ok()) {
    // The surface has passed every check, and TetGen reports the faults that it finds itself.
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_TETRAHEDRALIZATION_FAILED",
                   absl::StrCat("the mesher TetGen was ", bytes.status().message(),
                                " with every setting that was tried, which is a fault of TetGen "
                                "rather than of the surface: ask for another number of nodes, or "
                                "give a mesh of tetrahedra (Gmsh)"));
  }
  return MakeMesh(Parse(*bytes));
}

}  // namespace carillon::precompute
