// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/excitation/contact.h"

namespace carillon {

/// A grid of cubic cells over a surface. Each cell lists the triangles whose bounding boxes reach
/// into it, and so every triangle that has a point in the cell.
///
/// A cell is about as wide as a triangle. It is wider where the grid would otherwise have more than
/// 64 + 4 T cells or 64 + 12 T list entries for T triangles. The grid takes at most 520 + 88 T
/// bytes. A surface with a vertex that is not finite has no cells.
class SurfaceGrid {
 public:
  /// The bounding box of a triangle.
  struct Box {
    std::array<float, 3> least{};
    std::array<float, 3> most{};

    double SquaredDistanceFrom(const Point& point) const {
      double squared = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double away =
            std::max(std::max(least[axis] - point[axis], point[axis] - most[axis]), 0.0);
        squared += away * away;
      }
      return squared;
    }
  };

  /// A block of cells, by the first and the last cell along each axis.
  struct Block {
    std::array<uint32_t, 3> first{};
    std::array<uint32_t, 3> last{};

    size_t cell_count() const {
      size_t count = 1;
      for (size_t axis = 0; axis < 3; ++axis) count *= size_t{last[axis]} - first[axis] + 1;
      return count;
    }
    bool Contains(const Block& other) const {
      for (size_t axis = 0; axis < 3; ++axis) {
        if (other.first[axis] < first[axis] || other.last[axis] > last[axis]) return false;
      }
      return true;
    }
  };

  /// Makes the grid of #V vertices in metres and #T triangles, whose indices must be in range.
  SurfaceGrid(std::span<const std::array<float, 3>> vertices,
              std::span<const std::array<uint32_t, 3>> triangles);

  /// Returns false if the surface has no cells.
  bool usable() const { return !begins_.empty(); }
  /// The longest side of the box around the surface.
  double longest_side_m() const { return longest_side_m_; }
  const Box& box(uint32_t triangle) const { return boxes_[triangle]; }

  /// Returns the cells that hold every point of the surface whose coordinates differ by at most
  /// `radius_m` from those of `point`. Requires usable().
  Block Around(const Point& point, double radius_m) const {
    Block block;
    for (size_t axis = 0; axis < 3; ++axis) {
      block.first[axis] = CellOf(point[axis] - radius_m, axis);
      block.last[axis] = CellOf(point[axis] + radius_m, axis);
    }
    return block;
  }

  /// Calls `visit` with the triangles of each cell in ascending order. A triangle that lies in
  /// several cells is visited several times. Stops at a cell with more than kMostInCell triangles,
  /// and then returns false.
  template <typename Visitor>
  bool Visit(const Block& block, const Visitor& visit) const {
    for (uint32_t z = block.first[2]; z <= block.last[2]; ++z) {
      for (uint32_t y = block.first[1]; y <= block.last[1]; ++y) {
        for (uint32_t x = block.first[0]; x <= block.last[0]; ++x) {
          const size_t cell = IndexOf(x, y, z);
          const auto triangles =
              std::span(entries_).subspan(begins_[cell], begins_[cell + 1] - begins_[cell]);
          if (triangles.size() > kMostInCell) return false;
          visit(triangles);
        }
      }
    }
    return true;
  }

  static constexpr uint32_t kMostInCell = 64;

 private:
  /// Returns the cell of a coordinate along an axis. A larger coordinate never has a lower cell.
  uint32_t CellOf(double coordinate_m, size_t axis) const {
    const double cell = (coordinate_m - origin_m_[axis]) * cells_per_m_;
    return static_cast<uint32_t>(std::clamp<double>(cell, 0, size_[axis] - 1));
  }
  size_t IndexOf(uint32_t x, uint32_t y, uint32_t z) const {
    return (size_t{z} * size_[1] + y) * size_[0] + x;
  }
  Block BlockOf(const Box& box) const;
  void SetWidth(double width_m);
  bool Fits() const;
  void Fill();

  std::vector<Box> boxes_;  // #T
  std::array<double, 3> origin_m_{};
  std::array<double, 3> side_m_{};
  double longest_side_m_ = 0;
  double width_m_ = 0;
  double cells_per_m_ = 0;
  std::array<uint32_t, 3> size_{1, 1, 1};  // cells along each axis
  std::vector<uint32_t> begins_;           // of each cell within entries_, and the end
  std::vector<uint32_t> entries_;          // triangles
};

}  // namespace carillon
