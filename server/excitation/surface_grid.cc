// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/surface_grid.h"

#include <limits>

namespace carillon {
namespace {

constexpr size_t kMostCellsPerTriangle = 4, kMostEntriesPerTriangle = 12, kMoreOfEach = 64;
/// Largest number of cells along the longest side.
constexpr double kMostAlongASide = 1000;
constexpr double kWidening = 1.25;

/// Returns the width of an average triangle.
double WidthOfTriangles(std::span<const SurfaceGrid::Box> boxes) {
  double area = 0;  // sum over all boxes of three sides
  for (const SurfaceGrid::Box& box : boxes) {
    std::array<double, 3> side{};
    for (size_t axis = 0; axis < 3; ++axis) {
      side[axis] = double{box.most[axis]} - double{box.least[axis]};
    }
    area += side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
  }
  return std::sqrt(area / static_cast<double>(boxes.size()));
}

}  // namespace

SurfaceGrid::SurfaceGrid(std::span<const std::array<float, 3>> vertices,
                         std::span<const std::array<uint32_t, 3>> triangles) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Box whole{.least = {kInfinity, kInfinity, kInfinity},
            .most = {-kInfinity, -kInfinity, -kInfinity}};
  bool finite = true;
  boxes_.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    Box& box = boxes_.emplace_back();
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] =
          std::minmax({vertices[a][axis], vertices[b][axis], vertices[c][axis]});
      box.least[axis] = least;
      box.most[axis] = most;
      whole.least[axis] = std::min(whole.least[axis], least);
      whole.most[axis] = std::max(whole.most[axis], most);
      finite = finite && std::isfinite(vertices[a][axis]) && std::isfinite(vertices[b][axis]) &&
               std::isfinite(vertices[c][axis]);
    }
  }
  if (!finite || boxes_.empty()) return;
  for (size_t axis = 0; axis < 3; ++axis) {
    origin_m_[axis] = whole.least[axis];
    side_m_[axis] = double{whole.most[axis]} - origin_m_[axis];
  }
  longest_side_m_ = *std::ranges::max_element(side_m_);
  if (!(longest_side_m_ > 0)) return;
  double width_m = std::max(WidthOfTriangles(boxes_), longest_side_m_ / kMostAlongASide);
  for (SetWidth(width_m); !Fits(); SetWidth(width_m)) width_m *= kWidening;
  Fill();
}

void SurfaceGrid::SetWidth(double width_m) {
  width_m_ = width_m;
  cells_per_m_ = 1 / width_m;
  for (size_t axis = 0; axis < 3; ++axis) {
    size_[axis] = static_cast<uint32_t>(side_m_[axis] * cells_per_m_) + 1;
  }
}

SurfaceGrid::Block SurfaceGrid::BlockOf(const Box& box) const {
  Block block;
  for (size_t axis = 0; axis < 3; ++axis) {
    block.first[axis] = CellOf(box.least[axis], axis);
    block.last[axis] = CellOf(box.most[axis], axis);
  }
  return block;
}

/// Returns whether the cells and their entries are few enough. Two cells along each axis always
/// are.
bool SurfaceGrid::Fits() const {
  const size_t cell_count = size_t{size_[0]} * size_[1] * size_[2];
  if (cell_count > kMostCellsPerTriangle * boxes_.size() + kMoreOfEach) return false;
  const size_t most = kMostEntriesPerTriangle * boxes_.size() + kMoreOfEach;
  size_t count = 0;
  for (const Box& box : boxes_) {
    count += BlockOf(box).cell_count();
    if (count > most) return false;
  }
  return true;
}

void SurfaceGrid::Fill() {
  const auto for_each_cell = [this](const Block& block, const auto& visit) {
    for (uint32_t z = block.first[2]; z <= block.last[2]; ++z) {
      for (uint32_t y = block.first[1]; y <= block.last[1]; ++y) {
        for (uint32_t x = block.first[0]; x <= block.last[0]; ++x) visit(IndexOf(x, y, z));
      }
    }
  };
  begins_.assign(size_t{size_[0]} * size_[1] * size_[2] + 1, 0);
  for (const Box& box : boxes_) {
    for_each_cell(BlockOf(box), [this](size_t cell) { ++begins_[cell]; });
  }
  uint32_t end = 0;
  for (uint32_t& begin : begins_) {
    end += begin;
    begin = end;
  }
  entries_.resize(end);
  // The last triangle comes first, so that the triangles of each cell end up in ascending order.
  for (size_t t = boxes_.size(); t > 0; --t) {
    for_each_cell(BlockOf(boxes_[t - 1]), [this, t](size_t cell) {
      entries_[--begins_[cell]] = static_cast<uint32_t>(t - 1);
    });
  }
}

}  // namespace carillon
