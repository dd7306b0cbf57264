// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "precompute/fem/elastic_constants.h"
#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {

/// The material of a region of a body.
struct RegionMaterial {
  std::string region;  ///< its name; empty if the body has no regions
  ElasticConstants elastic{};
  double density_kg_per_m3 = 1;
};

/// The materials of a body: one for each region of its mesh, or one for the whole mesh.
class BodyMaterials {
 public:
  /// One material for the whole body.
  // NOLINTNEXTLINE(google-explicit-constructor): most bodies have one material.
  BodyMaterials(const ElasticConstants& elastic, double density_kg_per_m3 = 1)
      : BodyMaterials(std::vector{RegionMaterial{"", elastic, density_kg_per_m3}}) {}
  /// The materials of the regions, in the order of the numbers in TetMesh::regions.
  explicit BodyMaterials(std::vector<RegionMaterial> regions) : regions_(std::move(regions)) {
    lame_.reserve(regions_.size());
    for (const RegionMaterial& region : regions_) lame_.push_back(ToLame(region.elastic));
  }

  const LameConstants& LameOf(const TetMesh& mesh, size_t element) const {
    return lame_[mesh.RegionOf(element)];
  }
  double DensityOf(const TetMesh& mesh, size_t element) const {
    return regions_[mesh.RegionOf(element)].density_kg_per_m3;
  }
  const std::vector<RegionMaterial>& regions() const { return regions_; }

 private:
  std::vector<RegionMaterial> regions_;
  std::vector<LameConstants> lame_;
};

}  // namespace carillon::precompute
