// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/elastic_constants.h"

#include <gtest/gtest.h>

namespace carillon::precompute {
namespace {

TEST(ElasticConstants, UniaxialStressOfLameConstantsIsYoungsModulus) {
  // With strain (1, -nu, -nu), sigma_ij = lambda tr(e) delta_ij + 2 mu e_ij must be (E, 0, 0).
  const ElasticConstants elastic{.young_pa = 70e9, .poisson_ratio = 0.33};
  const auto [lambda, mu] = ToLame(elastic);
  const double trace = 1 - 2 * elastic.poisson_ratio;
  EXPECT_NEAR(lambda * trace + 2 * mu, elastic.young_pa, 1e-4);  // 15 digits of 7e10
  EXPECT_NEAR(lambda * trace - 2 * mu * elastic.poisson_ratio, 0, 1e-4);
}

TEST(ElasticConstants, FromLameInvertsToLame) {
  for (const double nu : {-0.5, 0.0, 0.3, 0.49}) {
    const ElasticConstants back = FromLame(ToLame({.young_pa = 2e11, .poisson_ratio = nu}));
    EXPECT_NEAR(back.young_pa / 2e11, 1, 1e-13);
    EXPECT_NEAR(back.poisson_ratio, nu, 1e-14);
  }
}

}  // namespace
}  // namespace carillon::precompute
