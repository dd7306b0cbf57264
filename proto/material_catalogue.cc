// SPDX-License-Identifier: Apache-2.0
#include "proto/material_catalogue.h"

#include <google/protobuf/text_format.h>

#include <cmath>
#include <cstdlib>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr char kCatalogueText[] =
#include "materials.inc"
    ;

v1::MaterialCatalogue ParseCatalogue() {
  v1::MaterialCatalogue catalogue;
  if (!google::protobuf::TextFormat::ParseFromString(kCatalogueText, &catalogue)) std::abort();
  return catalogue;
}

absl::StatusOr<v1::Material> FindPreset(const std::string& name) {
  std::string known;
  for (const v1::CatalogueMaterial& entry : Materials().materials()) {
    if (entry.name() == name) return entry.material();
    absl::StrAppend(&known, known.empty() ? "" : ", ", entry.name());
  }
  return absl::InvalidArgumentError(absl::StrCat("UNKNOWN_MATERIAL: no material is named \"", name,
                                                 "\"; name one of ", known,
                                                 ", or give the figures themselves"));
}

absl::Status OutOfRange(const char* field, double value, const char* range) {
  return absl::InvalidArgumentError(
      absl::StrCat("INVALID_MATERIAL: ", field, " is ", value, "; it must be ", range));
}

absl::Status Check(const v1::Material& m) {
  if (!m.has_young_pa() || !m.has_density_kg_per_m3() || !m.has_alpha1_s() ||
      !m.has_alpha2_per_s()) {
    return absl::InvalidArgumentError(
        "INVALID_MATERIAL: a material needs young_pa, density_kg_per_m3, alpha1_s and "
        "alpha2_per_s; "
        "name a preset to start from or give all four");
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
  return absl::OkStatus();
}

}  // namespace

const v1::MaterialCatalogue& Materials() {
  static const v1::MaterialCatalogue catalogue = ParseCatalogue();
  return catalogue;
}

absl::StatusOr<v1::Material> ResolveMaterial(const v1::Material& material) {
  v1::Material resolved;
  if (!material.preset().empty()) {
    absl::StatusOr<v1::Material> preset = FindPreset(material.preset());
    if (!preset.ok()) return preset.status();
    resolved = *std::move(preset);
  }
  resolved.MergeFrom(material);
  resolved.clear_preset();
  if (absl::Status status = Check(resolved); !status.ok()) return status;
  return resolved;
}

}  // namespace carillon
