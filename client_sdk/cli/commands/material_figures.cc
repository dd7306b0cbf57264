// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/material_figures.h"

#include <google/protobuf/text_format.h>

#include "absl/strings/str_cat.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/loss_factor.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

absl::StatusOr<v1::Material> ReadMaterial(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadText(path));
  v1::Material material;
  if (google::protobuf::TextFormat::ParseFromString(text, &material)) return material;
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_MATERIAL",
                 absl::StrCat(path,
                              " is not a Material as text: give a file that carillon material "
                              "fit --out wrote, or lines such as young_pa: 70e9"));
}

/// Converts the figures without regard to the regions.
absl::StatusOr<v1::Material> ToOneMaterial(const MaterialFigures& figures) {
  v1::Material material;
  if (!figures.file.empty()) {
    ASSIGN_OR_RETURN(material, ReadMaterial(figures.file));
  }
  if (!figures.preset.empty()) material.set_preset(figures.preset);
  if (figures.young_pa) material.set_young_pa(*figures.young_pa);
  if (figures.poisson_ratio) material.set_poisson_ratio(*figures.poisson_ratio);
  if (figures.density_kg_per_m3) material.set_density_kg_per_m3(*figures.density_kg_per_m3);
  if (figures.alpha1_s) material.set_alpha1_s(*figures.alpha1_s);
  if (figures.alpha2_per_s) material.set_alpha2_per_s(*figures.alpha2_per_s);
  if (!figures.loss_factor.empty()) {
    ASSIGN_OR_RETURN(const auto points, ReadLossFactor(figures.loss_factor));
    SetLossFactor(points, material);
  }
  return material;
}

}  // namespace

absl::StatusOr<v1::Material> ToMaterial(const MaterialFigures& figures) {
  ASSIGN_OR_RETURN(v1::Material material, ToOneMaterial(figures));
  AddRegions(figures.regions, material);
  return material;
}

std::string MaterialText(const v1::Material& material) {
  v1::Material figures = material;
  figures.clear_preset();
  std::string text = figures.ShortDebugString();
  if (material.preset().empty()) return text;
  const std::string preset = EscapedText(material.preset());
  return text.empty() ? preset : absl::StrCat(preset, " with ", text);
}

}  // namespace carillon::cli
