// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/hertz_contact_conversion.h"

#include "proto/cpp/status_macros.h"
#include "proto/cpp/striker_catalogue.h"

namespace carillon {

absl::StatusOr<HertzContact> ToHertzContact(const v1::HertzContact& proto) {
  HertzContact hertz;
  if (!proto.striker().empty()) {
    ASSIGN_OR_RETURN(const v1::CatalogueStriker striker, FindStriker(proto.striker()));
    hertz = {.striker_young_pa = striker.young_pa(),
             .striker_poisson_ratio = striker.poisson_ratio(),
             .striker_mass_kg = striker.mass_kg(),
             .striker_radius_m = striker.radius_m()};
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
  if (proto.has_striker_mass_kg()) hertz.striker_mass_kg = proto.striker_mass_kg();
  if (proto.has_striker_radius_m()) hertz.striker_radius_m = proto.striker_radius_m();
  return hertz;
}

}  // namespace carillon
