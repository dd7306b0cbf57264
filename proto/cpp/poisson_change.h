// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace carillon {

/// Returns Lambda(to) / Lambda(from) of a mode whose d ln Lambda / d nu is `slope` at Poisson's
/// ratio `from`, for fixed Young's modulus. Both ratios lie between -1 and 0.5.
///
/// A mode is taken for the mixture of two kinds of deformation that has the slope: shear, which
/// grows with nu like 1/(1 + nu), bending or stretching of a bar (1), bending of a plate,
/// 1/(1 - nu^2), and compression without room to the sides, (1 - nu)/((1 + nu)(1 - 2 nu)). For
/// bars, plates, bowls, cups and brackets a step of 0.1 misses frequencies by 0.06 % in the median,
/// and a linear one by 0.2 %.
double EigenvalueChange(double slope, double from, double to);

/// Returns whether a model that was made for Poisson's ratio `from` serves objects of the ratio
/// `to`: where both are the same as models round them, or, with the slopes of its eigenvalues,
/// within 0.07. Up to there EigenvalueChange misses no frequency of those bodies by more than 0.3
/// %.
bool ServesPoissonRatio(double from, double to, bool has_slopes);

}  // namespace carillon
