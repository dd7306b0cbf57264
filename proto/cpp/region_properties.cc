// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/region_properties.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/loss_factor.h"
#include "proto/cpp/material_catalogue.h"

namespace carillon {
namespace {

/// A stored model names the region of a surface triangle by one byte.
constexpr int kMostRegions = 255;

absl::Status InvalidRegions(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS", what);
}

absl::Status Differs(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "REGION_MATERIAL_DIFFERS", what);
}

bool IsSame(double figure, double first) {
  constexpr double kTolerance = 1e-6;  // relative
  return std::abs(figure / first - 1) <= kTolerance;
}

}  // namespace

void AddRegions(const std::vector<std::string>& texts, v1::Material& material) {
  if (texts.empty()) return;
  if (material.regions().empty()) {
    const v1::Material others = std::exchange(material, {});
    if (others.ByteSizeLong() > 0) *material.add_regions()->mutable_material() = others;
  }
  for (const std::string& text : texts) {
    const size_t sign = text.rfind('=');
    v1::RegionMaterial& entry = *material.add_regions();
    entry.set_region(text.substr(0, sign));
    entry.mutable_material()->set_preset(text.substr(sign + 1));
  }
}

const v1::Material* FindRegion(const v1::Material& material, absl::string_view region) {
  for (const absl::string_view name : {region, absl::string_view()}) {
    for (const v1::RegionMaterial& entry : material.regions()) {
      if (absl::EqualsIgnoreCase(entry.region(), name)) return &entry.material();
    }
  }
  return nullptr;
}

void SetRegions(const v1::Material& resolved, v1::DecompositionSettings& settings) {
  settings.clear_regions();
  for (const v1::RegionMaterial& entry : resolved.regions()) {
    const v1::Material& material = entry.material();
    v1::RegionProperties& properties = *settings.add_regions();
    properties.set_region(entry.region());
    properties.set_relative_young(material.young_pa() / resolved.young_pa());
    properties.set_relative_density(material.density_kg_per_m3() / resolved.density_kg_per_m3());
    properties.set_poisson_ratio(material.has_poisson_ratio()
                                     ? RoundedPoissonRatio(material.poisson_ratio())
                                     : settings.poisson_ratio());
  }
}

absl::Status CheckRegions(const v1::DecompositionSettings& settings) {
  if (settings.regions_size() > kMostRegions) {
    return InvalidRegions(absl::StrCat("there are ", settings.regions_size(), " regions; at most ",
                                       kMostRegions, " are taken"));
  }
  for (const v1::RegionProperties& region : settings.regions()) {
    for (const double ratio : {region.relative_young(), region.relative_density()}) {
      if (std::isfinite(ratio) && ratio > 0) continue;
      return InvalidRegions(
          absl::StrCat("the region \"", region.region(), "\" is ", ratio,
                       " times as stiff or dense as another; that must be above zero"));
    }
    if (region.poisson_ratio() > -1 && region.poisson_ratio() < 0.5) continue;
    return InvalidRegions(absl::StrCat("the region \"", region.region(),
                                       "\" has the Poisson's ratio ", region.poisson_ratio(),
                                       "; it must be greater than -1 and less than 0.5"));
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Material> MatchRegions(const v1::ModalModelHeader& header,
                                          const v1::Material& resolved) {
  if (header.regions().empty() && resolved.regions().empty()) return resolved;
  if (header.regions().empty()) {
    return Differs("the material has regions, and the model was computed for one material");
  }
  v1::Material matched;
  for (const v1::ModalModelRegion& region : header.regions()) {
    const std::string& name = region.properties().region();
    const v1::Material* const found = FindRegion(resolved, name);
    if (found == nullptr) {
      return Differs(
          absl::StrCat("the region \"", name, "\" of the model has no material: give it one"));
    }
    const double young_pa = found->young_pa() / region.properties().relative_young();
    const double density = found->density_kg_per_m3() / region.properties().relative_density();
    if (matched.regions().empty()) {
      matched.set_young_pa(young_pa);
      matched.set_density_kg_per_m3(density);
    }
    if (!IsSame(young_pa, matched.young_pa()) || !IsSame(density, matched.density_kg_per_m3())) {
      return Differs(absl::StrCat(
          "the material of the region \"", name,
          "\" differs from that of the model by another factor than that of \"",
          header.regions(0).properties().region(), "\": create a model with these materials"));
    }
    v1::RegionMaterial& entry = *matched.add_regions();
    entry.set_region(name);
    *entry.mutable_material() = *found;
  }
  for (const v1::RegionMaterial& given : resolved.regions()) {
    const auto is_its = [&](const v1::ModalModelRegion& region) {
      return given.region().empty() ||
             absl::EqualsIgnoreCase(region.properties().region(), given.region());
    };
    if (std::ranges::any_of(header.regions(), is_its)) continue;
    return Differs(absl::StrCat("a material is given for the region \"", given.region(),
                                "\", which the model does not have"));
  }
  return matched;
}

double RegionDecayRatePerS(const v1::Material& material, double natural_frequency_hz,
                           double strain_part, double kinetic_part) {
  const double omega = 2 * std::numbers::pi * natural_frequency_hz;
  const double eta = LossFactorAt(LossFactorOf(material), natural_frequency_hz);
  return (strain_part * (material.alpha1_s() * omega + eta) * omega +
          kinetic_part * material.alpha2_per_s()) /
         2;
}

double DecayRatePerS(const v1::ModalModelHeader& header, const v1::Material& matched, int mode,
                     double natural_frequency_hz) {
  if (header.regions().empty()) return DecayRatePerS(matched, natural_frequency_hz);
  double rate = 0;
  for (int r = 0; r < header.regions_size(); ++r) {
    rate += RegionDecayRatePerS(matched.regions(r).material(), natural_frequency_hz,
                                header.regions(r).strain_energy_parts(mode),
                                header.regions(r).kinetic_energy_parts(mode));
  }
  return rate;
}

}  // namespace carillon
