// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/size_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {

SizeField::SizeField(std::vector<Point> points, std::vector<double> relative_sizes, double slope)
    : points_(std::move(points)),
      relative_sizes_(std::move(relative_sizes)),
      slope_(slope),
      tree_(points_.size()),
      smallest_(points_.size()) {
  std::iota(tree_.begin(), tree_.end(), 0);
  Sort(0, tree_.size(), 0);
}

double SizeField::At(const Point& place) const {
  if (is_uniform()) return 1;
  double smallest = std::numeric_limits<double>::infinity();
  Search(place, 0, tree_.size(), 0, smallest);
  return smallest;
}

SizeField SizeField::Moved(const Point& low, double scale) const {
  SizeField moved = *this;
  for (Point& p : moved.points_) {
    for (size_t x = 0; x < 3; ++x) p[x] = (p[x] - low[x]) * scale;
  }
  moved.slope_ = slope_ / scale;
  return moved;
}

/// Sorts a range into the tree, and returns its smallest relative size.
double SizeField::Sort(size_t begin, size_t end, size_t axis) {
  if (begin == end) return std::numeric_limits<double>::infinity();
  const size_t middle = begin + (end - begin) / 2;
  const auto at = [this](size_t i) { return tree_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](int32_t a, int32_t b) {
    return points_[static_cast<size_t>(a)][axis] < points_[static_cast<size_t>(b)][axis];
  });
  const double low = Sort(begin, middle, (axis + 1) % 3);
  const double high = Sort(middle + 1, end, (axis + 1) % 3);
  return smallest_[middle] =
             std::min({low, high, relative_sizes_[static_cast<size_t>(tree_[middle])]});
}

void SizeField::Search(const Point& place, size_t begin, size_t end, size_t axis,
                       double& smallest) const {
  if (begin == end) return;
  const size_t middle = begin + (end - begin) / 2;
  if (smallest_[middle] >= smallest) return;
  const auto number = static_cast<size_t>(tree_[middle]);
  smallest =
      std::min(smallest, relative_sizes_[number] + slope_ * Distance(place, points_[number]));
  const double beyond = place[axis] - points_[number][axis];
  const auto search = [&](bool high) {
    const size_t from = high ? middle + 1 : begin, to = high ? end : middle;
    Search(place, from, to, (axis + 1) % 3, smallest);
  };
  search(beyond > 0);
  if (smallest_[middle] + slope_ * std::abs(beyond) < smallest) search(!(beyond > 0));
}

}  // namespace carillon::precompute
