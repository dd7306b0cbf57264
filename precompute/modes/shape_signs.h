// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace carillon::precompute {

/// Makes the first of the large components of each shape positive, so that the sign of a shape is
/// unique. The largest component would not do, because several components of a symmetric body are
/// largest within rounding.
void FixSigns(Eigen::MatrixXd& shapes);

}  // namespace carillon::precompute
