// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_locator.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/excitation/closest_point.h"
#include "server/excitation/surface_grid.h"

namespace carillon {
namespace {

absl::Status Malformed(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED", message);
}

absl::Status CheckTriangles(absl::string_view name,
                            std::span<const std::array<uint32_t, 3>> triangles,
                            size_t vertex_count) {
  if (triangles.empty()) {
    return Malformed(absl::StrCat("the ", name, " has no triangle: compute the model again"));
  }
  for (size_t t = 0; t < triangles.size(); ++t) {
    const uint32_t largest = *std::ranges::max_element(triangles[t]);
    if (largest < vertex_count) continue;
    return Malformed(absl::StrCat("triangle ", t, " of the ", name, " names vertex ", largest,
                                  " of ", vertex_count, ": compute the model again"));
  }
  return absl::OkStatus();
}

absl::Status Check(const LocatorSurfaces& surfaces) {
  absl::Status status =
      CheckTriangles("sounding surface", surfaces.triangles, surfaces.vertices.size());
  status.Update(
      CheckTriangles("surface as given", surfaces.given_triangles, surfaces.given_vertices.size()));
  if (status.ok() && surfaces.given_triangle.size() != surfaces.triangles.size()) {
    return Malformed(absl::StrCat(surfaces.given_triangle.size(), " given triangles are named for ",
                                  surfaces.triangles.size(),
                                  " triangles of the sounding surface: compute the model again"));
  }
  return status;
}

absl::Status OutOfMemory(const LocatorSurfaces& surfaces) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "SERVER_OUT_OF_MEMORY",
      absl::StrCat("there is too little memory for the index of ", surfaces.triangles.size(),
                   " triangles: ask for less, or give the daemon more"));
}

Point ToPoint(const std::array<float, 3>& vertex) { return {vertex[0], vertex[1], vertex[2]}; }

std::array<Point, 3> Corners(std::span<const std::array<float, 3>> vertices,
                             const std::array<uint32_t, 3>& triangle) {
  return {ToPoint(vertices[triangle[0]]), ToPoint(vertices[triangle[1]]),
          ToPoint(vertices[triangle[2]])};
}

Point Interpolate(const std::array<Point, 3>& corners, const std::array<double, 3>& weights) {
  Point point{};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < 3; ++i) point[axis] += weights[i] * corners[i][axis];
  }
  return point;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The state of a query. Embree hands it to the callback for each triangle that is near enough.
struct Search {
  const LocatorSurfaces& surfaces;
  const SurfaceGrid& grid;
  const Point& point;
  std::optional<uint32_t> given_triangle;  // if set, only triangles that lie on it count
  uint32_t triangle = 0;
  ClosestPoint closest{.squared_distance_m2 = kInfinity};

  bool found() const { return std::isfinite(closest.squared_distance_m2); }
  /// Compares a triangle with the nearest so far. Returns true if it is nearer, or as near with a
  /// lower index, so that the order in which triangles are considered does not matter.
  bool Consider(uint32_t t) {
    return MayBeNearest(t, grid.box(t).SquaredDistanceFrom(point)) && Measure(t);
  }
  /// Considers the triangles of a cell. The triangle whose box is nearest comes first, because it
  /// rules out most of the others.
  void ConsiderCell(std::span<const uint32_t> triangles);

 private:
  /// Returns false if the triangle cannot be the nearest. `box` is the squared distance of its box,
  /// which takes a fraction of the time of the triangle's own distance and is never larger.
  bool MayBeNearest(uint32_t t, double box) const;
  bool Measure(uint32_t t);
};

bool Search::MayBeNearest(uint32_t t, double box) const {
  // Far more than rounding errors, so that the nearest triangle is never left out.
  constexpr double kSlack = 1.001, kSlackM2 = 1e-24;
  const double best = closest.squared_distance_m2;
  if (box > kSlack * best + kSlackM2) return false;
  // Many points are corners of the surface, where several triangles meet.
  if (best == 0 && t > triangle) return false;
  return !given_triangle || surfaces.given_triangle[t] == *given_triangle;
}

bool Search::Measure(uint32_t t) {
  const ClosestPoint on_triangle =
      FindClosestPoint(Corners(surfaces.vertices, surfaces.triangles[t]), point);
  const double best = closest.squared_distance_m2, squared = on_triangle.squared_distance_m2;
  if (!(squared < best) && !(squared == best && t < triangle && found())) return false;
  triangle = t;
  closest = on_triangle;
  return true;
}

void Search::ConsiderCell(std::span<const uint32_t> triangles) {
  std::array<double, SurfaceGrid::kMostInCell> boxes;
  size_t nearest = 0;
  for (size_t i = 0; i < triangles.size(); ++i) {
    boxes[i] = grid.box(triangles[i]).SquaredDistanceFrom(point);
    if (boxes[i] < boxes[nearest]) nearest = i;
  }
  if (!triangles.empty() && MayBeNearest(triangles[nearest], boxes[nearest])) {
    Measure(triangles[nearest]);
  }
  for (size_t i = 0; i < triangles.size(); ++i) {
    if (i != nearest && MayBeNearest(triangles[i], boxes[i])) Measure(triangles[i]);
  }
}

/// Returns the radius within which a triangle may still be the nearest or as near. Embree computes
/// in single precision, so that the radius has room for rounding errors of point and distance.
float RadiusOf(const Search& search) {
  constexpr double kRounding = 1e-6;
  double magnitude = std::sqrt(search.closest.squared_distance_m2);
  const double radius = magnitude;
  for (const double coordinate : search.point) magnitude += std::abs(coordinate);
  return static_cast<float>(radius + kRounding * magnitude);
}

/// Embree calls this for each triangle that is near enough.
bool VisitTriangle(RTCPointQueryFunctionArguments* arguments) {
  Search& search = *static_cast<Search*>(arguments->userPtr);
  if (!search.Consider(arguments->primID)) return false;
  arguments->query->radius = std::min(arguments->query->radius, RadiusOf(search));
  return true;
}

template <typename T>
void CopyToBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                  std::span<const T> values) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), values.size());
  if (buffer != nullptr) std::memcpy(buffer, values.data(), values.size_bytes());
}

}  // namespace

/// The surfaces, the grid that finds points on and near them, and Embree's objects, which find all
/// other points.
struct SurfaceLocator::Index {
  explicit Index(const LocatorSurfaces& of)
      : surfaces(of),
        grid(of.vertices, of.triangles),
        // By default Embree builds its index with a thread on each core, which would disturb the
        // audio.
        device(rtcNewDevice("threads=1,user_threads=1")),
        scene(rtcNewScene(device)) {
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    CopyToBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, surfaces.vertices);
    CopyToBuffer(geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, surfaces.triangles);
    rtcSetGeometryPointQueryFunction(geometry, VisitTriangle);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Index() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Index(const Index&) = delete;
  Index& operator=(const Index&) = delete;

  /// Runs a query. Returns false if no triangle lies on the given triangle, or if the point is too
  /// far away.
  bool Run(Search& search) const { return RunInGrid(search) || RunEverywhere(search); }

  /// Searches the cell of the point, and then the cells around it. Returns false if a nearer
  /// triangle may lie outside these cells; the search has then often found a near one.
  bool RunInGrid(Search& search) const {
    constexpr size_t kMostCells = 8;  // Embree is faster than a search of more cells
    // Far more than rounding errors, as in MayBeNearest.
    constexpr double kSlack = 1.001, kSlackOfSide = 1e-9;
    if (!grid.usable()) return false;
    const auto consider = [&search](std::span<const uint32_t> cell) { search.ConsiderCell(cell); };
    const SurfaceGrid::Block searched = grid.Around(search.point, 0);
    if (!grid.Visit(searched, consider) || !search.found()) return false;
    const double radius = kSlack * std::sqrt(search.closest.squared_distance_m2) +
                          kSlackOfSide * grid.longest_side_m();
    const SurfaceGrid::Block within = grid.Around(search.point, radius);
    // Only Embree decides whether a point is too far away.
    if (radius > grid.longest_side_m()) search.closest.squared_distance_m2 = kInfinity;
    if (!search.found()) return false;
    if (searched.Contains(within)) return true;
    return within.cell_count() <= kMostCells && grid.Visit(within, consider);
  }

  bool RunEverywhere(Search& search) const {
    RTCPointQuery query{.x = static_cast<float>(search.point[0]),
                        .y = static_cast<float>(search.point[1]),
                        .z = static_cast<float>(search.point[2]),
                        .time = 0,
                        .radius = RadiusOf(search)};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene, &query, &context, nullptr, &search);
    return search.found();
  }

  LocatedPoint Describe(const Search& search) const {
    return {.triangle = search.triangle,
            .vertices = surfaces.triangles[search.triangle],
            .weights = search.closest.weights,
            .distance_m = std::sqrt(search.closest.squared_distance_m2)};
  }

  LocatorSurfaces surfaces;
  SurfaceGrid grid;
  RTCDevice device;
  RTCScene scene;
};

SurfaceLocator::SurfaceLocator(std::unique_ptr<Index> index) : index_(std::move(index)) {}

SurfaceLocator::~SurfaceLocator() = default;

absl::StatusOr<std::unique_ptr<SurfaceLocator>> SurfaceLocator::Make(
    const LocatorSurfaces& surfaces) {
  RETURN_IF_ERROR(Check(surfaces));
  auto index = std::make_unique<Index>(surfaces);
  if (const RTCError error = rtcGetDeviceError(index->device); error != RTC_ERROR_NONE) {
    if (error == RTC_ERROR_OUT_OF_MEMORY) return OutOfMemory(surfaces);
    return Refusal(
        absl::StatusCode::kInternal, "INTERNAL",
        absl::StrCat("the index of ", surfaces.triangles.size(),
                     " triangles could not be built, Embree error ", static_cast<int>(error)));
  }
  return std::unique_ptr<SurfaceLocator>(new SurfaceLocator(std::move(index)));
}

absl::StatusOr<LocatedPoint> SurfaceLocator::Nearest(const Point& point) const {
  RETURN_IF_ERROR(ValidatePoint(point));
  Search search{.surfaces = index_->surfaces,
                .grid = index_->grid,
                .point = point,
                .given_triangle = std::nullopt};
  if (index_->Run(search)) return index_->Describe(search);
  return Refusal(absl::StatusCode::kInvalidArgument, "CONTACT_MALFORMED",
                 absl::StrCat("the point of contact ", point[0], ",", point[1], ",", point[2],
                              " m is too far away to tell what is nearest to it: send metres in "
                              "the object's frame"));
}

absl::StatusOr<LocatedPoint> SurfaceLocator::OnGivenTriangle(const SurfacePoint& at) const {
  RETURN_IF_ERROR(ValidateWeights(at.weights));
  const LocatorSurfaces& surfaces = index_->surfaces;
  if (at.triangle >= surfaces.given_triangles.size()) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "CONTACT_MALFORMED",
        absl::StrCat("triangle ", at.triangle, " of a surface of ", surfaces.given_triangles.size(),
                     ": triangles count from zero, in the order of the mesh file"));
  }
  const Point point = Interpolate(
      Corners(surfaces.given_vertices, surfaces.given_triangles[at.triangle]), at.weights);
  Search search{
      .surfaces = surfaces, .grid = index_->grid, .point = point, .given_triangle = at.triangle};
  if (index_->Run(search)) return index_->Describe(search);
  return Nearest(point);  // a repair of the surface may have removed that triangle
}

}  // namespace carillon
