// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Lamé's constants of an isotropic material.
struct LameConstants {
  double lambda_pa;
  double mu_pa;
};

/// Young's modulus (> 0) and Poisson's ratio (in (-1, 0.5)) of an isotropic material.
struct ElasticConstants {
  double young_pa;
  double poisson_ratio;
};

/// Returns lambda = E nu / ((1 + nu)(1 - 2 nu)) and mu = E / (2 (1 + nu)).
LameConstants ToLame(const ElasticConstants& elastic);

}  // namespace carillon::precompute
