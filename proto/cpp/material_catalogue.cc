// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/material_catalogue.h"

#include <google/protobuf/text_format.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/near_names.h"

namespace carillon {
namespace {

constexpr char kMaterialsText[] =
#include "materials.inc"
#include "proto/cpp/status_macros.h"
    ;

v1::MaterialCatalogue ParseMaterials() {
  v1::MaterialCatalogue catalogue;
  if (!google::protobuf::TextFormat::ParseFromString(kMaterialsText, &catalogue)) std::abort();
  return catalogue;
}

absl::StatusOr<v1::Material> FindPreset(const std::string& name) {
  std::vector<std::string> known;
  for (const v1::CatalogueMaterial& entry : Materials().materials()) {
    if (entry.name() == name) return entry.material();
    known.push_back(entry.name());
  }
  return UnknownName("UNKNOWN_MATERIAL", "material", name, known);
}

/// Lets the damping that is asked for replace the loss factor of the preset. Without this, a
/// loss factor would be appended to the points of the preset, and Rayleigh damping added to it.
void DropReplacedLossFactor(const v1::Material& asked, v1::Material& preset) {
  if (asked.loss_factor_size() > 0 || asked.has_alpha1_s() || asked.has_alpha2_per_s()) {
    preset.clear_loss_factor();
  }
}

absl::Status OutOfRange(const char* field, double value, const char* range) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrCat(field, " is ", value, "; it must be ", range));
}

absl::Status CheckLossFactor(const v1::Material& m) {
  constexpr int kMostPoints = 256;
  if (m.loss_factor_size() > kMostPoints) {
    return OutOfRange("the number of points of loss_factor", m.loss_factor_size(), "at most 256");
  }
  double last_hz = 0;
  for (const v1::LossFactorPoint& point : m.loss_factor()) {
    if (!(point.frequency_hz() > last_hz && std::isfinite(point.frequency_hz()))) {
      return OutOfRange("loss_factor.frequency_hz", point.frequency_hz(),
                        "greater than zero and than that of the point before");
    }
    const bool none = m.loss_factor(0).loss_factor() == 0;
    if (!(point.loss_factor() >= 0 && point.loss_factor() < 2) ||
        (point.loss_factor() == 0) != none) {
      return OutOfRange("loss_factor.loss_factor", point.loss_factor(),
                        "greater than zero and less than 2, or zero at every point");
    }
    last_hz = point.frequency_hz();
  }
  return absl::OkStatus();
}

absl::Status Check(const v1::Material& m) {
  if (!m.has_young_pa() || !m.has_density_kg_per_m3() || !m.has_alpha1_s() ||
      !m.has_alpha2_per_s()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                   "a material needs young_pa, density_kg_per_m3, alpha1_s and alpha2_per_s (or "
                   "loss_factor); name a preset to start from or give all four");
  }
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  const auto not_negative = [](double x) { return std::isfinite(x) && x >= 0; };
  if (!positive(m.young_pa())) return OutOfRange("young_pa", m.young_pa(), "greater than zero");
  if (!positive(m.density_kg_per_m3())) {
    return OutOfRange("density_kg_per_m3", m.density_kg_per_m3(), "greater than zero");
  }
  if (!not_negative(m.alpha1_s())) return OutOfRange("alpha1_s", m.alpha1_s(), "zero or more");
  if (!not_negative(m.alpha2_per_s())) {
    return OutOfRange("alpha2_per_s", m.alpha2_per_s(), "zero or more");
  }
  if (m.has_poisson_ratio() && !(m.poisson_ratio() > -1 && m.poisson_ratio() < 0.5)) {
    return OutOfRange("poisson_ratio", m.poisson_ratio(), "greater than -1 and less than 0.5");
  }
  return CheckLossFactor(m);
}

/// Resolves a material without regard to its regions.
absl::StatusOr<v1::Material> ResolveOne(const v1::Material& material) {
  v1::Material resolved;
  if (!material.preset().empty()) {
    ASSIGN_OR_RETURN(resolved, FindPreset(material.preset()));
    DropReplacedLossFactor(material, resolved);
  }
  resolved.MergeFrom(material);
  resolved.clear_preset();
  if (resolved.loss_factor_size() > 0) {
    resolved.set_alpha1_s(resolved.alpha1_s());
    resolved.set_alpha2_per_s(resolved.alpha2_per_s());
  }
  RETURN_IF_ERROR(Check(resolved));
  return resolved;
}

absl::Status InvalidRegion(const std::string& region, absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrCat("the region \"", absl::CEscape(region), "\" ", what));
}

/// Resolves the materials of regions, and makes the first one the reference.
absl::StatusOr<v1::Material> ResolveRegions(const v1::Material& material) {
  std::map<std::string, v1::Material> of_regions;
  for (const v1::RegionMaterial& entry : material.regions()) {
    if (!entry.material().regions().empty()) {
      return InvalidRegion(entry.region(), "has regions of its own: give it one material");
    }
    ASSIGN_OR_RETURN(v1::Material resolved, ResolveOne(entry.material()));
    const std::string name = absl::AsciiStrToLower(entry.region());
    if (!of_regions.emplace(name, std::move(resolved)).second) {
      return InvalidRegion(entry.region(), "has two materials: give it one");
    }
  }
  v1::Material resolved = of_regions.begin()->second;
  if (!material.preset().empty()) {
    return InvalidRegion("",
                         "has the material that the preset beside the regions names: give it "
                         "an entry without a name");
  }
  if (material.has_young_pa()) resolved.set_young_pa(material.young_pa());
  if (material.has_density_kg_per_m3()) {
    resolved.set_density_kg_per_m3(material.density_kg_per_m3());
  }
  RETURN_IF_ERROR(Check(resolved));
  for (auto& [name, one] : of_regions) {
    v1::RegionMaterial& added = *resolved.add_regions();
    added.set_region(name);
    *added.mutable_material() = std::move(one);
  }
  return resolved;
}

}  // namespace

const v1::MaterialCatalogue& Materials() {
  static const v1::MaterialCatalogue catalogue = ParseMaterials();
  return catalogue;
}

absl::StatusOr<v1::Material> ResolveMaterial(const v1::Material& material) {
  return material.regions().empty() ? ResolveOne(material) : ResolveRegions(material);
}

std::vector<LossFactorPoint> LossFactorOf(const v1::Material& material) {
  std::vector<LossFactorPoint> points;
  for (const v1::LossFactorPoint& point : material.loss_factor()) {
    points.push_back({point.frequency_hz(), point.loss_factor()});
  }
  return points;
}

void SetLossFactor(std::span<const LossFactorPoint> points, v1::Material& material) {
  material.clear_loss_factor();
  for (const LossFactorPoint& point : points) {
    v1::LossFactorPoint& added = *material.add_loss_factor();
    added.set_frequency_hz(point.frequency_hz);
    added.set_loss_factor(point.loss_factor);
  }
}

double DecayRatePerS(const v1::Material& resolved, double natural_frequency_hz) {
  const double omega = 2 * std::numbers::pi * natural_frequency_hz;
  const double eta = LossFactorAt(LossFactorOf(resolved), natural_frequency_hz);
  return (resolved.alpha1_s() * omega * omega + resolved.alpha2_per_s() + eta * omega) / 2;
}

}  // namespace carillon
