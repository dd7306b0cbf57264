// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client_sdk/cli/options/options.h"

namespace carillon::cli {
namespace {

template <class T>
void AddOptionalFigure(CLI::App& app, const std::string& name, std::optional<T>& target,
                       const std::string& description) {
  app.add_option(name, target, description)->group("Material");
}

}  // namespace

void AddMaterial(CLI::App& app, MaterialFigures& material) {
  app.add_option_function<std::vector<std::string>>(
         "--material",
         [&material](const std::vector<std::string>& texts) {
           for (const std::string& text : texts) {
             const bool is_region = text.find('=') != std::string::npos;
             if (!is_region && !material.preset.empty()) {
               throw CLI::ValidationError("--material", "only regions have several materials");
             }
             if (is_region) material.regions.push_back(text);
             if (!is_region) material.preset = text;
           }
         },
         "A named material, or REGION=NAME for a region of the mesh file; the figures below "
         "override those of the first")
      ->allow_extra_args(false)
      ->group("Material");
  app.add_option("--material-file", material.file,
                 "A file with a material as text, as carillon material fit writes it; the figures "
                 "below override it")
      ->group("Material");
  AddOptionalFigure(app, "--young", material.young_pa, "Young's modulus, Pa");
  AddOptionalFigure(app, "--poisson", material.poisson_ratio, "Poisson's ratio");
  AddOptionalFigure(app, "--density", material.density_kg_per_m3, "Density, kg/m^3");
  AddOptionalFigure(app, "--alpha1", material.alpha1_s,
                    "Damping in proportion to stiffness, s; it replaces a loss factor");
  AddOptionalFigure(app, "--alpha2", material.alpha2_per_s, "Damping proportional to mass, 1/s");
  app.add_option("--loss-factor", material.loss_factor,
                 "Damping by a loss factor: ETA, or HZ:ETA,HZ:ETA,...; 0 is no damping but that of "
                 "--alpha1, --alpha2 and the air")
      ->group("Material");
}

}  // namespace carillon::cli
