// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/fill/element_size.h"

#include <algorithm>
#include <cstddef>

#include "precompute/mesh/point_math.h"

namespace carillon::precompute {

double SurfaceElementSize(const SurfaceMesh& surface, const SizeField& relative_size) {
  double area = 0, sum = 0;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto [a, b, c] = CornersOf(surface, t);
    const double doubled = Norm(AreaNormal({a, b, c}));
    area += doubled;
    sum += doubled * std::max({Distance(a, b), Distance(b, c), Distance(c, a)}) /
           relative_size.At(MiddleOf({a, b, c}));
  }
  return sum / area;
}

}  // namespace carillon::precompute
