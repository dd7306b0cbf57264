// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/mesh/surface_mesh.h"

namespace carillon::precompute {

/// An element size that varies from place to place, relative to a size that is given beside it. A
/// field without points is 1 everywhere.
class SizeField {
 public:
  SizeField() = default;
  /// `relative_sizes` has a positive number for each point. The relative size grows with the
  /// distance from a point by `slope`, 1/m.
  SizeField(std::vector<Point> points, std::vector<double> relative_sizes, double slope);

  /// Returns the smallest size that a point allows at `place`: the point's relative size plus slope
  /// times distance.
  double At(const Point& place) const;

  bool is_uniform() const { return points_.empty(); }

  /// Returns the same field for a body that was first moved by `-low` and then multiplied by
  /// `scale`.
  SizeField Moved(const Point& low, double scale) const;

 private:
  double Sort(size_t begin, size_t end, size_t axis);
  void Search(const Point& place, size_t begin, size_t end, size_t axis, double& smallest) const;

  std::vector<Point> points_;
  std::vector<double> relative_sizes_;
  double slope_ = 0;
  /// A k-d tree: the middle of each range of numbers of points divides the range along x, y, z in
  /// turn.
  std::vector<int32_t> tree_;
  /// The smallest relative size of each range, at the middle of the range.
  std::vector<double> smallest_;
};

}  // namespace carillon::precompute
