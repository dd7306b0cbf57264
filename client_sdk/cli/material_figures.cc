// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/material_figures.h"

#include "proto/cpp/error_reason.h"
#include "proto/cpp/loss_factor.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {

absl::StatusOr<v1::Material> ToMaterial(const MaterialFigures& figures) {
  v1::Material material;
  material.set_preset(figures.preset);
  if (figures.young_pa) material.set_young_pa(*figures.young_pa);
  if (figures.poisson_ratio) material.set_poisson_ratio(*figures.poisson_ratio);
  if (figures.density_kg_per_m3) material.set_density_kg_per_m3(*figures.density_kg_per_m3);
  if (figures.alpha1_s) material.set_alpha1_s(*figures.alpha1_s);
  if (figures.alpha2_per_s) material.set_alpha2_per_s(*figures.alpha2_per_s);
  if (!figures.loss_factor.empty()) {
    ASSIGN_OR_RETURN(const auto points, ReadLossFactor(figures.loss_factor));
    SetLossFactor(points, material);
  }
  if (!figures.lame_lambda_pa && !figures.lame_mu_pa) return material;
  if (!figures.lame_lambda_pa || !figures.lame_mu_pa || figures.young_pa || figures.poisson_ratio) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                   "give --young and --poisson, or both --lame-lambda and --lame-mu");
  }
  const double lambda = *figures.lame_lambda_pa, mu = *figures.lame_mu_pa;
  material.set_young_pa(mu * (3 * lambda + 2 * mu) / (lambda + mu));
  material.set_poisson_ratio(lambda / (2 * (lambda + mu)));
  return material;
}

}  // namespace carillon::cli
