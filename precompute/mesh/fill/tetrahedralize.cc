// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/tetrahedralize.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/fill/element_size.h"
#include "precompute/mesh/fill/fill_with_tetgen.h"
#include "precompute/mesh/fill/midside_nodes.h"
#include "precompute/mesh/mesh_limits.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/refine_surface.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

// An automatic mesh has edges of at most a twentieth of the body's length, and elements whose
// length is at most a fixed multiple of the wall's thickness, unless that would exceed these two
// limits on the number of elements. This finds the first bending mode of a compact body within 1 %
// and can be solved in seconds.
constexpr double kEdgesAlongBody = 20;
constexpr double kEdgesPerThickness = 8;
constexpr double kMinElements = 1'500;
constexpr double kMaxElements = 12'000;
constexpr size_t kMaxTriangles = 20'000;  // about 60,000 nodes with mid-sides in a thin wall
constexpr double kCoarsening = 1.2;

constexpr double kLongestToMeanEdge =
    1.4;  // where edges above the longest are cut into equal parts
constexpr double kVolumeOfRegular = 0.11785;  // of a tetrahedron with edges of length 1

constexpr int kNodesPerCorner = 8;  // about, of a solid with mid-side nodes

constexpr int kMaxCorrections = 3;
constexpr double kTargetTolerance = 0.2;

// The number of nodes is proportional to a power of the edge length between -2 (on the surface) and
// -3 (inside).
constexpr double kEdgeByNodes = 1 / 2.5;
constexpr int kMaxEdgeSteps = 8;
constexpr double kCoarsestToElementSize = 2.5;
constexpr double kLongestToElementSize = 1.2;  // as uniform meshes of boxes and profiles have
constexpr double kNodesPerCubedEdge = 2;       // as TetGen fills solids

/// Where a surface lies and how large it is; scale * (p - low) is within the unit box.
struct UnitBox {
  Point low;
  double scale;
};

UnitBox FindUnitBox(const SurfaceMesh& surface) {
  Point low = surface.vertices.front(), high = low;
  for (const Point& p : surface.vertices) {
    for (size_t x = 0; x < 3; ++x) {
      low[x] = std::min(low[x], p[x]);
      high[x] = std::max(high[x], p[x]);
    }
  }
  const Point size = Difference(high, low);
  return {low, 1 / std::max({size[0], size[1], size[2]})};
}

struct Extent {
  double area = 0;
  double volume = 0;
};

Extent Measure(const SurfaceMesh& surface, const std::vector<Shell>& shells) {
  Extent extent;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    extent.area += Norm(AreaNormal(CornersOf(surface, t))) / 2;
  }
  for (const Shell& shell : shells) extent.volume += shell.volume_m3;
  extent.volume = std::abs(extent.volume);
  return extent;
}

/// Estimated number of elements with edges of length `edge`: regular tetrahedra inside, or, if the
/// wall is thinner than an edge, one layer of three elements for each pair of opposite triangles.
double ExpectedElements(const Extent& extent, double edge) {
  const double inside = extent.volume * 6 * std::sqrt(2.0) / (edge * edge * edge);
  const double on_surface = 1.5 * extent.area * 4 / (std::sqrt(3.0) * edge * edge);
  return std::max(inside, on_surface);
}

/// The edge length for which about `count` elements are expected, at unit size.
double EdgeForElements(const Extent& extent, double count) {
  double low = 1e-6, high = 1;
  for (int step = 0; step < 60; ++step) {
    const double middle = std::sqrt(low * high);
    (ExpectedElements(extent, middle) > count ? low : high) = middle;
  }
  return high;
}

double AutomaticEdge(const Extent& extent) {
  const double thickness = 2 * extent.volume / extent.area;
  const double edge = std::min(1 / kEdgesAlongBody, kEdgesPerThickness * thickness);
  return std::clamp(edge, EdgeForElements(extent, kMaxElements),
                    EdgeForElements(extent, kMinElements));
}

/// Triangles that are this many times as long as wide make the mesher fail.
constexpr double kVeryNarrow = 500;

/// The largest ratio of a triangle's longest edge to its height above that edge.
double NarrownessOf(const SurfaceMesh& surface) {
  double narrowest = 0;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto corners = CornersOf(surface, t);
    double longest = 0;
    for (size_t i = 0; i < 3; ++i) {
      longest = std::max(longest, Distance(corners[i], corners[(i + 1) % 3]));
    }
    const double double_area = Norm(AreaNormal(corners));
    if (double_area > 0) narrowest = std::max(narrowest, longest * longest / double_area);
  }
  return narrowest;
}

absl::Status CheckVolumes(const TetMesh& mesh, double surface_volume) {
  double sum = 0;
  for (size_t e = 0; e < mesh.elements.size(); e += 4) {
    const auto node = [&](size_t i) {
      return mesh.nodes[static_cast<size_t>(mesh.elements[e + i])];
    };
    const double volume = TetVolume(node(0), node(1), node(2), node(3));
    if (volume <= 0) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_TETRAHEDRALIZATION_FAILED",
                     absl::StrCat("tetrahedron ", e / 4, " came out flat near (", node(0)[0], ", ",
                                  node(0)[1], ", ", node(0)[2],
                                  ") of the unit box: move apart what nearly touches there"));
    }
    sum += volume;
  }
  if (std::abs(sum - surface_volume) > 1e-6 * surface_volume) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "MESH_TETRAHEDRALIZATION_FAILED",
        absl::StrCat("the tetrahedra fill ", sum / surface_volume,
                     " of the volume inside the surface: repair parts of it that touch"));
  }
  return absl::OkStatus();
}

absl::Status CheckNodeCount(double count) {
  if (count <= kMaxMeshNodes) return absl::OkStatus();
  return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                 absl::StrCat("the mesh would have ", count, " nodes; the limit is ", kMaxMeshNodes,
                              ": give a coarser surface or a smaller target_node_count"));
}

SurfaceMesh ToUnitBox(SurfaceMesh surface, const UnitBox& box) {
  for (Point& p : surface.vertices) {
    for (size_t x = 0; x < 3; ++x) p[x] = (p[x] - box.low[x]) * box.scale;
  }
  return surface;
}

void FromUnitBox(TetMesh& mesh, const UnitBox& box) {
  for (Point& p : mesh.nodes) {
    for (size_t x = 0; x < 3; ++x) p[x] = p[x] / box.scale + box.low[x];
  }
}

int NodesPerCorner(const MeshingSettings& settings) {
  return settings.nodes_per_element == 10 ? kNodesPerCorner : 1;
}

std::vector<Point> PointsInCavities(const SurfaceMesh& surface, const std::vector<Shell>& shells) {
  std::vector<Point> points;
  for (size_t s = 1; s < shells.size(); ++s) points.push_back(PointInside(surface, shells[s]));
  return points;
}

/// A surface at unit size, filled as finely as asked.
class Filler {
 public:
  /// The last `wall_count` triangles of the surface are walls inside the body.
  Filler(const SurfaceMesh& unit_surface, size_t wall_count, const UnitBox& box,
         const MeshingSettings& settings)
      : surface_(unit_surface),
        outside_(unit_surface),
        scale_(box.scale),
        settings_(settings),
        relative_size_(settings.element_size_m != 0
                           ? settings.relative_size.Moved(box.low, box.scale)
                           : SizeField()),
        has_walls_(wall_count > 0) {
    outside_.triangles.resize(outside_.triangles.size() - wall_count);
    shells_ = FindShells(outside_);
    extent_ = Measure(outside_, shells_);
  }

  absl::StatusOr<TetMesh> Fill() const {
    if (settings_.element_size_m != 0) return FillToElementSize(settings_.element_size_m * scale_);
    if (settings_.target_node_count != 0) return FillToTarget();
    return FillWithEdge(CoarserOnNarrowTriangles(AutomaticEdge(extent_)));
  }

 private:
  /// Narrow triangles are split into many more parts than their area suggests. In that case longer
  /// edges are used, up to the longest with which the body can still bend.
  double CoarserOnNarrowTriangles(double edge) const {
    const auto count = [&](double longest) {
      return RefineSurface(surface_, longest).surface.triangles.size();
    };
    while (edge * kCoarsening <= 1 / kEdgesAlongBody &&
           count(edge * kLongestToMeanEdge) > std::max(kMaxTriangles, surface_.triangles.size())) {
      edge *= kCoarsening;
    }
    return edge;
  }

  /// Estimated number of nodes: those of the refined surface, and those inside the part of the body
  /// that is deeper than half an edge.
  double ExpectedNodes(double edge) const {
    const SurfaceMesh surface = RefineSurface(surface_, LongestOnSurface(edge)).surface;
    const double deep = std::max(extent_.volume - extent_.area * edge / 2, 0.0);
    return static_cast<double>(surface.vertices.size()) +
           kNodesPerCubedEdge * deep / (edge * edge * edge);
  }

  /// The edge, from `edge` on, for which about `count` nodes are expected.
  double EdgeForNodes(double count, double edge) const {
    for (int step = 0; step < kMaxEdgeSteps; ++step) {
      const double excess = ExpectedNodes(edge) / count;
      if (std::abs(excess - 1) < kTargetTolerance / 4) break;
      edge = std::min(edge * std::pow(excess, kEdgeByNodes), 1.0);
    }
    return edge;
  }

  /// First by the estimate, then corrected by the error of the estimate.
  absl::StatusOr<TetMesh> FillToTarget() const {
    const double target = settings_.target_node_count;
    double edge = EdgeForNodes(target, EdgeForElements(extent_, 4 * target));
    absl::StatusOr<TetMesh> mesh = FillWithEdge(edge);
    for (int correction = 0; correction < kMaxCorrections && mesh.ok(); ++correction) {
      const double count = static_cast<double>(mesh->nodes.size());
      if (std::abs(count / target - 1) < kTargetTolerance) break;
      const double better = EdgeForNodes(target * ExpectedNodes(edge) / count, edge);
      if (better == edge) break;
      edge = better;
      mesh = FillWithEdge(edge);
    }
    return mesh;
  }

  /// Elements inside may be as long as the longest edge on the surface, so that a surface finer
  /// than necessary does not refine the inside.
  absl::StatusOr<TetMesh> FillToElementSize(double element_size) const {
    const double edge = EdgeForElementSize(element_size);
    return FillWithEdge(edge, kLongestToMeanEdge * edge);
  }

  /// The longest edge with which the element size of the surface is at most `element_size`. All
  /// edges of a surface of few triangles are split at once, so that the result may be finer.
  double EdgeForElementSize(double element_size) const {
    if (!relative_size_.is_uniform()) {
      return kLongestToElementSize / kLongestToMeanEdge * element_size;
    }
    double fine = element_size, coarse = kCoarsestToElementSize * element_size;
    for (int step = 0; step < kMaxEdgeSteps; ++step) {
      const double middle = std::sqrt(fine * coarse);
      const SurfaceMesh refined = RefineSurface(surface_, middle, relative_size_).surface;
      (SurfaceElementSize(refined, relative_size_) <= element_size ? fine : coarse) = middle;
    }
    return fine / kLongestToMeanEdge;
  }

  double LongestOnSurface(double edge) const {
    return settings_.keep_surface.value_or(false) ? std::numeric_limits<double>::infinity()
                                                  : kLongestToMeanEdge * edge;
  }

  /// The processor time for one try: 5 s, and 1 ms for each expected tetrahedron and each triangle,
  /// but at most 600 s. TetGen usually takes less than 20 us for a tetrahedron.
  std::chrono::seconds MostCpu(const RefinedSurface& refined, double max_volume) const {
    const double tetrahedra = extent_.volume / max_volume;
    const auto triangles = static_cast<double>(refined.surface.triangles.size());
    return std::chrono::seconds(std::lround(std::min(5 + (tetrahedra + triangles) / 1000, 600.0)));
  }

  int MostAdded() const {
    // TetGen's count must not end a mesh that still has fewer nodes than the limit.
    constexpr double kMargin = 2;
    const double limit = settings_.most_node_count;
    const double most =
        limit > 0 ? std::min<double>(kMaxMeshNodes, kMargin * limit) : kMaxMeshNodes;
    return static_cast<int>(most / NodesPerCorner(settings_));
  }

  absl::StatusOr<TetMesh> FillWithEdge(double edge) const { return FillWithEdge(edge, edge); }

  absl::StatusOr<TetMesh> FillWithEdge(double edge, double inside) const {
    const bool keep_surface = settings_.keep_surface.value_or(false);
    const RefinedSurface refined = RefineSurface(surface_, LongestOnSurface(edge), relative_size_);
    const double max_volume = kVolumeOfRegular * inside * inside * inside;
    FillRequest request{.surface = refined,
                        .cavities = PointsInCavities(outside_, shells_),
                        .has_walls = has_walls_,
                        .max_volume = max_volume,
                        .relative_size = relative_size_,
                        .keep_surface = true,
                        .max_added_nodes = MostAdded(),
                        .most_cpu = MostCpu(refined, max_volume),
                        .cautious = settings_.cautious};
    return FillSomehow(request, keep_surface);
  }

  /// Fills with the settings asked for, and where the mesher fails, with others. Returns the first
  /// failure if all fail.
  absl::StatusOr<TetMesh> FillSomehow(FillRequest request, bool keep_surface) const {
    absl::StatusOr<TetMesh> first = FillAndCheck(request);
    const auto try_another = [&](bool keep, bool cautious) {
      if (first.ok() || absl::IsResourceExhausted(first.status())) return;
      request.keep_surface = keep;
      request.cautious = cautious;
      absl::StatusOr<TetMesh> mesh = FillAndCheck(request);
      if (mesh.ok()) first = std::move(mesh);
    };
    if (!keep_surface) try_another(false, settings_.cautious);
    if (!settings_.cautious) try_another(true, true);
    if (!settings_.cautious && !keep_surface) try_another(false, true);
    if (!first.ok()) return Explained(first.status());
    return first;
  }

  /// Returns the refusal, with the cause if the surface has very narrow triangles.
  absl::Status Explained(const absl::Status& refusal) const {
    const double narrowest = NarrownessOf(surface_);
    const v1::ErrorInfo error = ToErrorInfo(refusal);
    if (error.reason() != "MESH_TETRAHEDRALIZATION_FAILED" || narrowest < kVeryNarrow) {
      return refusal;
    }
    absl::Status explained = Refusal(
        refusal.code(), error.reason(),
        absl::StrFormat("the mesher failed on triangles up to %.0f times as long as wide: divide "
                        "them, or make a slender body thicker or shorter",
                        narrowest));
    AddFigure(explained, "narrowness", absl::StrFormat("%.0f", narrowest));
    return explained;
  }

  absl::StatusOr<TetMesh> FillAndCheck(const FillRequest& request) const {
    ASSIGN_OR_RETURN(TetMesh mesh, FillWithTetgen(request));
    RETURN_IF_ERROR(CheckVolumes(mesh, extent_.volume));
    return mesh;
  }

  const SurfaceMesh& surface_;
  SurfaceMesh outside_;  // without the walls
  double scale_;         // size of the given surface over that of the unit surface
  const MeshingSettings& settings_;
  SizeField relative_size_;  // in the unit box
  bool has_walls_;
  std::vector<Shell> shells_;
  Extent extent_;
};

}  // namespace

absl::StatusOr<TetMesh> Tetrahedralize(const SurfaceMesh& surface, const MeshingSettings& settings,
                                       std::span<const std::array<int32_t, 3>> walls) {
  const double target = settings.target_node_count;
  RETURN_IF_ERROR(CheckNodeCount(target * NodesPerCorner(settings)));
  const UnitBox box = FindUnitBox(surface);
  SurfaceMesh unit_surface = ToUnitBox(surface, box);
  unit_surface.triangles.insert(unit_surface.triangles.end(), walls.begin(), walls.end());
  ASSIGN_OR_RETURN(TetMesh mesh, Filler(unit_surface, walls.size(), box, settings).Fill());
  FromUnitBox(mesh, box);
  if (settings.nodes_per_element == 10) AddMidsideNodes(mesh);
  RETURN_IF_ERROR(CheckNodeCount(static_cast<double>(mesh.nodes.size())));
  return mesh;
}

}  // namespace carillon::precompute
