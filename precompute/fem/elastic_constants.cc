// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/elastic_constants.h"

namespace carillon::precompute {

LameConstants ToLame(const ElasticConstants& elastic) {
  const auto [young, nu] = elastic;
  return {.lambda_pa = young * nu / ((1 + nu) * (1 - 2 * nu)), .mu_pa = young / (2 * (1 + nu))};
}

}  // namespace carillon::precompute
