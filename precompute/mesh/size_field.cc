// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/size_field.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace carillon::precompute {
namespace {

double SquaredDistance(const Point& a, const Point& b) {
  double sum = 0;
  for (size_t x = 0; x < 3; ++x) sum += (a[x] - b[x]) * (a[x] - b[x]);
  return sum;
}

}  // namespace

SizeField::SizeField(std::vector<Point> points, std::vector<double> relative_sizes)
    : points_(std::move(points)), relative_sizes_(std::move(relative_sizes)), tree_(points_.size()) {
  std::iota(tree_.begin(), tree_.end(), 0);
  Sort(0, tree_.size(), 0);
}

double SizeField::At(const Point& place) const {
  if (is_uniform()) return 1;
  Nearest nearest{std::numeric_limits<double>::infinity(), 0};
  Search(place, 0, tree_.size(), 0, nearest);
  return relative_sizes_[static_cast<size_t>(nearest.point)];
}

SizeField SizeField::Moved(const Point& low, double scale) const {
  SizeField moved = *this;
  for (Point& p : moved.points_) {
    for (size_t x = 0; x < 3; ++x) p[x] = (p[x] - low[x]) * scale;
  }
  return moved;
}

void SizeField::Sort(size_t begin, size_t end, size_t axis) {
  if (end - begin < 2) return;
  const size_t middle = begin + (end - begin) / 2;
  const auto at = [this](size_t i) { return tree_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](int32_t a, int32_t b) {
    return points_[static_cast<size_t>(a)][axis] < points_[static_cast<size_t>(b)][axis];
  });
  Sort(begin, middle, (axis + 1) % 3);
  Sort(middle + 1, end, (axis + 1) % 3);
}

void SizeField::Search(const Point& place, size_t begin, size_t end, size_t axis,
                       Nearest& nearest) const {
  if (begin == end) return;
  const size_t middle = begin + (end - begin) / 2;
  const int32_t number = tree_[middle];
  const Point& point = points_[static_cast<size_t>(number)];
  const double distance = SquaredDistance(place, point);
  if (std::pair(distance, number) < std::pair(nearest.squared_distance, nearest.point)) {
    nearest = {distance, number};
  }
  const double beyond = place[axis] - point[axis];
  const size_t next = (axis + 1) % 3;
  const auto search = [&](bool high) {
    high ? Search(place, middle + 1, end, next, nearest)
         : Search(place, begin, middle, next, nearest);
  };
  search(beyond > 0);
  if (beyond * beyond <= nearest.squared_distance) search(!(beyond > 0));
}

}  // namespace carillon::precompute
