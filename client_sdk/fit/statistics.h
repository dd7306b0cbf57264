// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace carillon::fit {

/// Returns the median, or zero of no values.
double Median(std::vector<double> values);

/// Returns 1.4826 times the median distance from the median, which is the standard deviation where
/// the values are normal.
double MedianDeviation(const std::vector<double>& values);

}  // namespace carillon::fit
