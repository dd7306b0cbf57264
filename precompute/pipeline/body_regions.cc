// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/body_regions.h"

#include <map>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

std::string RegionText(const MeshRegion& region) {
  if (region.material.empty()) return QuotedText(region.name);
  return absl::StrCat(QuotedText(region.name), " (of ", QuotedText(region.material), ")");
}

absl::Status RegionUnknown(absl::string_view what, const std::vector<MeshRegion>& regions) {
  std::vector<std::string> names;
  names.reserve(regions.size());
  for (const MeshRegion& region : regions) names.push_back(RegionText(region));
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MESH_REGION_UNKNOWN",
      absl::StrCat(what, ": ",
                   names.empty() ? std::string("the file has no regions; give one material")
                                 : absl::StrCat("give each region of the file one (--material "
                                                "REGION=NAME); they are ",
                                                absl::StrJoin(names, ", "))));
}

using Entries = google::protobuf::RepeatedPtrField<v1::RegionProperties>;

/// Returns the entry of a region's name, else of its material's, else of all others, or else null.
const v1::RegionProperties* Find(const Entries& entries, const MeshRegion& region) {
  for (const std::string& name : {region.name, region.material, std::string()}) {
    for (const v1::RegionProperties& entry : entries) {
      if (absl::EqualsIgnoreCase(entry.region(), name)) return &entry;
    }
  }
  return nullptr;
}

absl::Status CheckOneMaterial(const std::vector<MeshRegion>& regions) {
  std::set<std::string> materials;
  for (const MeshRegion& region : regions) materials.insert(absl::AsciiStrToUpper(region.material));
  materials.erase("");
  if (materials.size() < 2) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MESH_ELEMENT_UNSUPPORTED",
      absl::StrCat("the file has sections of ", materials.size(), " materials, ",
                   QuotedText(*materials.begin()), " and ", QuotedText(*materials.rbegin()),
                   " among them: give each a material (--material \"", *materials.begin(),
                   "=NAME\"), or export the elements of one material alone"));
}

}  // namespace

absl::StatusOr<RegionMaterials> MaterialsOf(const worker::v1::WorkerRequest& request,
                                            const MeshNames& names) {
  const std::vector<MeshRegion>& regions = names.regions;
  const v1::DecompositionSettings& settings = request.settings();
  if (settings.regions().empty()) {
    // The materials of a surface may be no more than its colours.
    if (names.triangle_regions.empty()) RETURN_IF_ERROR(CheckOneMaterial(regions));
    return RegionMaterials{
        BodyMaterials({.young_pa = 1, .poisson_ratio = settings.poisson_ratio()})};
  }
  if (regions.empty()) return RegionUnknown("materials are given by region", regions);
  std::vector<RegionMaterial> materials;
  std::vector<int32_t> material_of_region;
  std::map<const v1::RegionProperties*, int32_t> used;
  for (const MeshRegion& region : regions) {
    const v1::RegionProperties* const found = Find(settings.regions(), region);
    if (found == nullptr) {
      return RegionUnknown(absl::StrCat("the region ", RegionText(region), " has no material"),
                           regions);
    }
    const auto [number, is_new] = used.emplace(found, static_cast<int32_t>(materials.size()));
    material_of_region.push_back(number->second);
    if (!is_new) {
      if (found->region().empty()) materials[static_cast<size_t>(number->second)].region.clear();
      continue;
    }
    materials.push_back(
        {.region = found->region().empty() ? region.name : found->region(),
         .elastic = {.young_pa = found->relative_young(), .poisson_ratio = found->poisson_ratio()},
         .density_kg_per_m3 = found->relative_density()});
  }
  for (const v1::RegionProperties& entry : settings.regions()) {
    if (entry.region().empty() || used.contains(&entry)) continue;
    return RegionUnknown(absl::StrCat("a material is given for the region ",
                                      QuotedText(entry.region()), ", which is none of the file's"),
                         regions);
  }
  return RegionMaterials{BodyMaterials(std::move(materials)), std::move(material_of_region)};
}

absl::Status TakeReference(const ModalModel& model, v1::Material& material) {
  if (model.regions.empty()) return absl::OkStatus();
  v1::ModalModelHeader header;
  for (const ModelRegion& region : model.regions) {
    v1::RegionProperties& properties = *header.add_regions()->mutable_properties();
    properties.set_region(region.material.region);
    properties.set_relative_young(region.material.elastic.young_pa);
    properties.set_relative_density(region.material.density_kg_per_m3);
    properties.set_poisson_ratio(region.material.elastic.poisson_ratio);
  }
  ASSIGN_OR_RETURN(material, MatchRegions(header, material));
  return absl::OkStatus();
}

}  // namespace carillon::precompute
