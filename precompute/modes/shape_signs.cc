// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/shape_signs.h"

#include <algorithm>
#include <cmath>

namespace carillon::precompute {

void FixSigns(Eigen::MatrixXd& shapes) {
  for (Eigen::Index m = 0; m < shapes.cols(); ++m) {
    auto shape = shapes.col(m);
    const double large = 0.99 * shape.cwiseAbs().maxCoeff();
    const auto first =
        std::ranges::find_if(shape, [large](double x) { return std::abs(x) >= large; });
    if (*first < 0) shape *= -1;
  }
}

}  // namespace carillon::precompute
