// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/hertz_contact_conversion.h"

#include <limits>
#include <string>

#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"
#include "proto/cpp/striker_catalogue.h"

namespace carillon {

namespace {

/// Sets the figures of a striker, or those of a floor of a material. Each contact of a step comes
/// here, so that the few strikers, which most name, are looked through first.
absl::Status SetNamed(const std::string& name, HertzContact& hertz) {
  for (const v1::CatalogueStriker& striker : Strikers().strikers()) {
    if (striker.name() != name) continue;
    hertz.striker_young_pa = striker.young_pa();
    hertz.striker_poisson_ratio = striker.poisson_ratio();
    hertz.striker_mass_kg = striker.mass_kg();
    hertz.striker_mass_is_named = true;
    hertz.striker_radius_m = striker.radius_m();
    return absl::OkStatus();
  }
  for (const v1::CatalogueMaterial& floor : Materials().materials()) {
    if (floor.name() != name) continue;
    hertz.striker_young_pa = floor.material().young_pa();
    hertz.striker_poisson_ratio = floor.material().poisson_ratio();
    hertz.striker_mass_kg = std::numeric_limits<double>::max();
    hertz.striker_radius_m = std::numeric_limits<double>::max();
    return absl::OkStatus();
  }
  return FindStriker(name).status();  // which says what names there are
}

}  // namespace

absl::StatusOr<HertzContact> ToHertzContact(const v1::HertzContact& proto) {
  HertzContact hertz;
  if (!proto.striker().empty()) {
    RETURN_IF_ERROR(SetNamed(proto.striker(), hertz));
  }
  if (proto.has_reduced_mass_kg()) hertz.reduced_mass_kg = proto.reduced_mass_kg();
  if (proto.has_reduced_radius_m()) hertz.reduced_radius_m = proto.reduced_radius_m();
  if (proto.has_approach_speed_m_per_s()) {
    hertz.approach_speed_m_per_s = proto.approach_speed_m_per_s();
  }
  if (proto.has_striker_young_pa()) hertz.striker_young_pa = proto.striker_young_pa();
  if (proto.has_striker_poisson_ratio()) {
    hertz.striker_poisson_ratio = proto.striker_poisson_ratio();
  }
  if (proto.has_striker_mass_kg()) {
    hertz.striker_mass_kg = proto.striker_mass_kg();
    hertz.striker_mass_is_named = false;
  }
  if (proto.has_striker_radius_m()) hertz.striker_radius_m = proto.striker_radius_m();
  return hertz;
}

}  // namespace carillon
