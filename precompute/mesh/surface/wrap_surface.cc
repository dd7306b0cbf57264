// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/wrap_surface.h"

#include <CGAL/alpha_wrap_3.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/run_in_child.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/halfedge_mesh.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// Parts of the diagonal: holes wider than alpha are entered; the wrap lies an offset outside, and
/// is then drawn back onto the surface.
constexpr double kAlphaPart = kWrappedHolePart;
constexpr double kOffsetPart = 1.0 / 2000;
constexpr std::chrono::seconds kMostCpu(300);

absl::Status Failed(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_REPAIR_FAILED",
                 absl::StrCat("the surface could not be repaired: ", what,
                              ". Repair it in a mesh editor, or give a mesh of tetrahedra"));
}

/// Runs in the child: CGAL's assertions end the process.
std::string RunWrap(const SurfaceMesh& given, double diagonal) {
  std::vector<HalfedgeKernel::Point_3> points;
  points.reserve(given.vertices.size());
  for (const Point& p : given.vertices) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<size_t, 3>> triangles;
  for (const auto& triangle : given.triangles) {
    if (IsCollapsed(triangle)) continue;
    const auto& [a, b, c] = triangle;
    triangles.push_back({static_cast<size_t>(a), static_cast<size_t>(b), static_cast<size_t>(c)});
  }
  HalfedgeMesh wrap;
  CGAL::alpha_wrap_3(points, triangles, kAlphaPart * diagonal, kOffsetPart * diagonal, wrap);
  return ToBytes(std::move(wrap));
}

/// Whether a triangle has kept its direction and an angle, so that tetrahedra can stand on it.
bool HasKeptItsForm(const std::array<Point, 3>& before, const std::array<Point, 3>& after) {
  constexpr double kLeastHeight = 0.05;  // of the longest side
  constexpr double kLeastCosine = 0.5;
  const Point old_normal = AreaNormal(before), normal = AreaNormal(after);
  double longest = 0;
  for (size_t i = 0; i < 3; ++i) {
    longest = std::max(longest, Distance(after[i], after[(i + 1) % 3]));
  }
  return Norm(normal) > kLeastHeight * longest * longest &&
         Dot(normal, old_normal) > kLeastCosine * Norm(normal) * Norm(old_normal);
}

/// Puts the corners of triangles that have lost their form back to where they were.
bool PutBack(const SurfaceMesh& wrap, SurfaceMesh& drawn) {
  bool put_back = false;
  for (size_t t = 0; t < wrap.triangles.size(); ++t) {
    if (HasKeptItsForm(CornersOf(wrap, t), CornersOf(drawn, t))) continue;
    for (const int32_t v : wrap.triangles[t]) {
      Point& p = drawn.vertices[static_cast<size_t>(v)];
      put_back |= p != wrap.vertices[static_cast<size_t>(v)];
      p = wrap.vertices[static_cast<size_t>(v)];
    }
  }
  return put_back;
}

/// Each vertex that lies about an offset away drawn `part` of the way onto the surface, where the
/// triangles bear it.
SurfaceMesh DrawnBack(const SurfaceMesh& wrap, const NearestTriangle& given, double offset,
                      double part) {
  SurfaceMesh drawn = wrap;
  for (Point& p : drawn.vertices) {
    const NearestTriangle::Place place = given.Find(p);
    if (place.distance_m > 2 * offset) continue;  // spans a hole
    for (size_t i = 0; i < 3; ++i) p[i] += part * (place.point[i] - p[i]);
  }
  while (PutBack(wrap, drawn)) {
  }
  return drawn;
}

bool Inside(const SurfaceMesh& wrap, const std::vector<Shell>& shells, const Point& point) {
  double winding = 0;
  for (const Shell& shell : shells) winding += WindingNumber(wrap, shell, point);
  return std::abs(winding) > 0.5;
}

/// The part of the given surface's area, sampled, that has nothing behind it on either side: a
/// sheet, of which the wrap, not yet drawn back, is one offset away on both.
double SheetPart(const SurfaceMesh& given, const SurfaceMesh& wrap, double offset) {
  constexpr double kAway = 1.5;  // offsets
  constexpr int kSampleCount = 200;
  std::vector<double> area;
  for (size_t t = 0; t < given.triangles.size(); ++t) {
    area.push_back(Norm(AreaNormal(CornersOf(given, t))));
  }
  std::mt19937 random(1);
  std::discrete_distribution<size_t> pick(area.begin(), area.end());
  const std::vector<Shell> shells = FindShells(wrap);
  int sheet_count = 0;
  for (int i = 0; i < kSampleCount; ++i) {
    const auto corners = CornersOf(given, pick(random));
    const Point normal = AreaNormal(corners), middle = MiddleOf(corners);
    Point front, back;
    for (size_t k = 0; k < 3; ++k) {
      front[k] = middle[k] + kAway * offset * normal[k] / Norm(normal);
      back[k] = middle[k] - kAway * offset * normal[k] / Norm(normal);
    }
    if (!Inside(wrap, shells, front) && !Inside(wrap, shells, back)) ++sheet_count;
  }
  return static_cast<double>(sheet_count) / kSampleCount;
}

std::string Remark(const SurfaceMesh& wrap, const SurfaceMesh& given, const NearestTriangle& index,
                   double diagonal) {
  const double out = GreatestDistance(wrap, index);
  const double in = GreatestDistance(given, NearestTriangle(wrap));
  return absl::StrFormat(
      "the surface was wrapped: %d triangles, at most %.3g m (%.2g of the diagonal) from the given "
      "surface, of which no part is further than %.3g m (%.2g) from them; holes narrower than "
      "%.3g m are closed, what was inside is gone",
      wrap.triangles.size(), out, out / diagonal, in, in / diagonal, kAlphaPart * diagonal);
}

}  // namespace

absl::StatusOr<RepairedSurface> WrapSurface(const SurfaceMesh& given) {
  const double diagonal = Diagonal(given.vertices);
  if (!(diagonal > 0)) return Failed("it has no extent");
  const absl::StatusOr<std::string> bytes =
      RunInChild([&] { return RunWrap(given, diagonal); }, kMostCpu);
  if (!bytes.ok()) return Failed(absl::StrCat("wrapping it was ", bytes.status().message()));
  const SurfaceMesh wrap = SurfaceFromBytes(*bytes);
  if (wrap.triangles.empty()) return Failed("its wrap is empty");
  const double offset = kOffsetPart * diagonal;
  constexpr double kMostSheet = 0.05;
  if (SheetPart(given, wrap, offset) > kMostSheet) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_NOT_CLOSED",
        absl::StrFormat("the surface encloses nothing, or has a hole wider than %.3g m, the widest "
                        "that wrapping closes: close the hole, or, if the surface is a thin wall, "
                        "give it a thickness (--wall)",
                        kAlphaPart * diagonal));
  }
  const NearestTriangle index(given);
  for (const double part : {1.0, 0.5, 0.0}) {
    SurfaceMesh drawn = DrawnBack(wrap, index, offset, part);
    const absl::Status sound = CheckSurface(drawn).status();
    if (sound.ok()) return RepairedSurface{drawn, {Remark(drawn, given, index, diagonal)}};
    if (part == 0) return sound;
  }
  return Failed("its wrap is not sound");
}

}  // namespace carillon::precompute
