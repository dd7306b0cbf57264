// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/near_correction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "absl/container/flat_hash_map.h"
#include "precompute/mesh/point_math.h"
#include "precompute/radiation/triangle_potential.h"
#include "precompute/radiation/triangle_rule.h"

namespace carillon::precompute {
namespace {

constexpr double kFourPi = 4 * std::numbers::pi;

/// Distances between the middles of two triangles, in mean edges. Pairs nearer than kNear are
/// integrated exactly. The nearer the pair, the finer the outer rule.
constexpr double kNear = 2.5;
constexpr double kNearMedium = 1.5;
constexpr double kNearFine = 0.8;

using Block = std::array<std::array<double, 3>, 3>;

/// Integrals over an outer and an inner triangle, for the hat functions [outer corner][inner
/// corner].
struct PairIntegrals {
  Block single{};
  Block doubled{};  ///< derivative along the inner triangle's normal
};

/// The triangles of a surface, sorted into cubic cells so that the triangles near a place are found
/// quickly.
class TriangleGrid {
 public:
  TriangleGrid(std::span<const Point> middles, double cell_m) : cell_m_(cell_m) {
    for (size_t t = 0; t < middles.size(); ++t) {
      cells_[CellOf(middles[t], {0, 0, 0})].push_back(static_cast<int32_t>(t));
    }
  }

  /// Calls visit(t) for all triangles whose middles may be nearer to `place` than a cell's size.
  template <typename Visit>
  void VisitNear(const Point& place, const Visit& visit) const {
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(CellOf(place, {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1}));
      if (found == cells_.end()) continue;
      for (const int32_t t : found->second) visit(static_cast<size_t>(t));
    }
  }

 private:
  using Cell = std::array<int64_t, 3>;

  Cell CellOf(const Point& place, const std::array<int, 3>& step) const {
    Cell cell;
    for (size_t a = 0; a < 3; ++a) {
      cell[a] = static_cast<int64_t>(std::floor(place[a] / cell_m_)) + step[a];
    }
    return cell;
  }

  double cell_m_;
  absl::flat_hash_map<Cell, std::vector<int32_t>> cells_;
};

class NearAssembly {
 public:
  NearAssembly(const AcousticSurface& surface, Workers& workers)
      : surface_(surface), workers_(workers) {
    for (size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
      const auto corner = CornersOf(surface.mesh, t);
      middles_.push_back(MiddleOf(corner));
      potentials_.emplace_back(corner);
      auto& curls = curls_.emplace_back();
      for (size_t c = 0; c < 3; ++c) curls[c] = CurlOfHat(surface, t, c);
    }
  }

  NearCorrection Make() && {
    FindNear();
    MakePattern();
    // Each thread sums into entries of its own, always for the same triangles, so that two runs
    // have the same rounding errors.
    std::vector<NearCorrection> parts(static_cast<size_t>(workers_.count()), result_);
    workers_.Run([&](int thread) {
      NearCorrection& part = parts[static_cast<size_t>(thread)];
      for (auto outer = static_cast<size_t>(thread); outer < near_.size(); outer += parts.size()) {
        for (const int32_t inner : near_[outer]) {
          AddPair(outer, static_cast<size_t>(inner), part);
        }
      }
    });
    for (const NearCorrection& part : parts) Sum(part);
    return std::move(result_);
  }

 private:
  void FindNear() {
    const double reach_m = kNear * surface_.mean_edge_m;
    const TriangleGrid grid(middles_, reach_m);
    near_.resize(middles_.size());
    workers_.ForEach(static_cast<int64_t>(middles_.size()), [&](int64_t i) {
      const auto t = static_cast<size_t>(i);
      grid.VisitNear(middles_[t], [&](size_t other) {
        if (Distance(middles_[t], middles_[other]) < reach_m) {
          near_[t].push_back(static_cast<int32_t>(other));
        }
      });
    });
  }

  /// Makes the pattern of the matrix. Two vertices are near if two of their triangles are near.
  void MakePattern() {
    const size_t n = surface_.vertex_count();
    std::vector<std::vector<int32_t>> rows(n);
    for (size_t t = 0; t < near_.size(); ++t) {
      for (const int32_t v : surface_.mesh.triangles[t]) {
        auto& row = rows[static_cast<size_t>(v)];
        for (const int32_t other : near_[t]) {
          const auto& corners = surface_.mesh.triangles[static_cast<size_t>(other)];
          row.insert(row.end(), corners.begin(), corners.end());
        }
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
      }
    }
    result_.row_begin.push_back(0);
    for (const auto& row : rows) {
      result_.columns.insert(result_.columns.end(), row.begin(), row.end());
      result_.row_begin.push_back(static_cast<int64_t>(result_.columns.size()));
    }
    result_.entries.resize(result_.columns.size());
    for (auto* diagonal : {&result_.double_layer, &result_.single_layer, &result_.curls}) {
      diagonal->assign(n, 0);
    }
  }

  double AreaOf(size_t t) const { return Norm(surface_.triangle_area_vectors[t]); }

  PairIntegrals Exact(size_t outer, size_t inner) const {
    const double away = Distance(middles_[outer], middles_[inner]) / surface_.mean_edge_m;
    const auto rule = away < kNearFine     ? FineTriangleRule()
                      : away < kNearMedium ? MediumTriangleRule()
                                           : CoarseTriangleRule();
    const auto corner = CornersOf(surface_.mesh, outer);
    PairIntegrals sum;
    for (const TrianglePoint& point : rule) {
      const TrianglePotentials at = potentials_[inner].At(PlaceIn(corner, point.hat));
      const double weight = AreaOf(outer) * point.weight / kFourPi;
      for (size_t a = 0; a < 3; ++a) {
        for (size_t b = 0; b < 3; ++b) {
          sum.single[a][b] += weight * point.hat[a] * at.single[b];
          if (outer != inner) sum.doubled[a][b] += weight * point.hat[a] * at.doubled[b];
        }
      }
    }
    return sum;
  }

  /// Returns the integrals by the vertex rule on both triangles, in which a vertex does not act on
  /// itself.
  PairIntegrals Lumped(size_t outer, size_t inner) const {
    const auto x = CornersOf(surface_.mesh, outer), y = CornersOf(surface_.mesh, inner);
    const double weight = AreaOf(outer) / (9 * kFourPi);
    PairIntegrals result;
    for (size_t a = 0; a < 3; ++a) {
      for (size_t b = 0; b < 3; ++b) {
        const Point away = Difference(x[a], y[b]);
        const double r = Norm(away);
        if (r == 0) continue;
        result.single[a][b] = weight * AreaOf(inner) / r;
        result.doubled[a][b] =
            weight * Dot(surface_.triangle_area_vectors[inner], away) / (r * r * r);
      }
    }
    return result;
  }

  void AddPair(size_t outer, size_t inner, NearCorrection& part) const {
    const PairIntegrals exact = Exact(outer, inner), lumped = Lumped(outer, inner);
    const auto& rows = surface_.mesh.triangles[outer];
    const auto& columns = surface_.mesh.triangles[inner];
    const Point n_outer = UnitNormal(outer), n_inner = UnitNormal(inner);
    const double normals = Dot(n_outer, n_inner);
    double single_sum = 0, lumped_sum = 0;
    for (size_t a = 0; a < 3; ++a) {
      for (size_t b = 0; b < 3; ++b) {
        single_sum += exact.single[a][b];
        lumped_sum += lumped.single[a][b];
      }
    }
    for (size_t a = 0; a < 3; ++a) {
      for (size_t b = 0; b < 3; ++b) {
        const double single = exact.single[a][b] - lumped.single[a][b];
        const double doubled = exact.doubled[a][b] - lumped.doubled[a][b];
        const double curls = Dot(curls_[outer][a], curls_[inner][b]);
        NearEntry& entry = EntryAt(rows[a], columns[b], part);
        entry.double_layer += static_cast<float>(doubled);
        entry.single_layer += static_cast<float>(normals * single);
        entry.curls += static_cast<float>(curls * (single_sum - lumped_sum));
        for (size_t i = 0; i < 3; ++i) {
          entry.source[i] += static_cast<float>(n_inner[i] * single);
          entry.adjoint[i] += static_cast<float>(n_outer[i] * doubled);
        }
        if (rows[a] != columns[b]) continue;
        const auto v = static_cast<size_t>(rows[a]);
        part.double_layer[v] += exact.doubled[a][b];
        part.single_layer[v] += normals * exact.single[a][b];
        part.curls[v] += curls * single_sum;
      }
    }
  }

  Point UnitNormal(size_t t) const {
    Point normal = surface_.triangle_area_vectors[t];
    const double area = AreaOf(t);
    for (double& x : normal) x /= area;
    return normal;
  }

  NearEntry& EntryAt(int32_t row, int32_t column, NearCorrection& part) const {
    const auto begin = result_.columns.begin() + result_.row_begin[static_cast<size_t>(row)];
    const auto end = result_.columns.begin() + result_.row_begin[static_cast<size_t>(row) + 1];
    const auto found = std::lower_bound(begin, end, column);
    return part.entries[static_cast<size_t>(found - result_.columns.begin())];
  }

  void Sum(const NearCorrection& part) {
    for (size_t i = 0; i < part.entries.size(); ++i) {
      NearEntry& to = result_.entries[i];
      const NearEntry& from = part.entries[i];
      to.double_layer += from.double_layer;
      to.single_layer += from.single_layer;
      to.curls += from.curls;
      for (size_t a = 0; a < 3; ++a) {
        to.source[a] += from.source[a];
        to.adjoint[a] += from.adjoint[a];
      }
    }
    for (size_t v = 0; v < part.curls.size(); ++v) {
      result_.double_layer[v] += part.double_layer[v];
      result_.single_layer[v] += part.single_layer[v];
      result_.curls[v] += part.curls[v];
    }
  }

  const AcousticSurface& surface_;
  Workers& workers_;
  std::vector<Point> middles_;
  std::vector<TrianglePotential> potentials_;
  std::vector<std::array<Point, 3>> curls_;  ///< curls of the hat functions of each triangle
  std::vector<std::vector<int32_t>> near_;
  NearCorrection result_;
};

}  // namespace

NearCorrection MakeNearCorrection(const AcousticSurface& surface, Workers& workers) {
  return NearAssembly(surface, workers).Make();
}

}  // namespace carillon::precompute
