// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/codec/modal_model_codec.h"

#include <bit>
#include <span>

#include "precompute/codec/record_file.h"
#include "proto/cpp/model_format.h"

static_assert(std::endian::native == std::endian::little, "arrays are stored little endian");

namespace carillon::precompute {
namespace {

std::vector<std::array<float, 3>> ToFloat(const std::vector<Point>& points) {
  std::vector<std::array<float, 3>> result;
  result.reserve(points.size());
  for (const auto& [x, y, z] : points) {
    result.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  }
  return result;
}

/// The numbers of each of kModelArrays, which the arguments own.
std::array<Bytes, kModelArrayCount> Arrays(
    const ModalModel& model, const std::vector<std::array<float, 3>>& given_vertices) {
  return {BytesOf(model.eigenvalues), BytesOf(model.residuals),       BytesOf(model.couplings),
          BytesOf(model.vertices),    BytesOf(model.triangles),       BytesOf(model.given_triangle),
          BytesOf(given_vertices),    BytesOf(model.given.triangles), BytesOf(model.shapes)};
}

ModelSizes SizesOf(const ModalModel& model) {
  return {.modes = model.eigenvalues.size(),
          .vertices = model.vertices.size(),
          .triangles = model.triangles.size(),
          .given_vertices = model.given.vertices.size(),
          .given_triangles = model.given.triangles.size()};
}

v1::Verification ToProto(const Verification& proof) {
  v1::Verification result;
  result.set_max_residual(proof.max_residual);
  result.set_max_orthogonality_error(proof.max_orthogonality_error);
  result.set_rigid_mode_count(static_cast<uint32_t>(proof.rigid_mode_count));
  result.set_sturm_count(static_cast<uint32_t>(proof.sturm_count));
  result.set_sturm_eigenvalue(proof.sturm_eigenvalue);
  return result;
}

void AddRegions(const ModalModel& model, v1::ModalModelHeader& header) {
  for (const ModelRegion& region : model.regions) {
    v1::ModalModelRegion& added = *header.add_regions();
    v1::RegionProperties& properties = *added.mutable_properties();
    properties.set_region(region.material.region);
    properties.set_relative_young(region.material.elastic.young_pa);
    properties.set_relative_density(region.material.density_kg_per_m3);
    properties.set_poisson_ratio(region.material.elastic.poisson_ratio);
    for (const double part : region.strain_parts) {
      added.add_strain_energy_parts(static_cast<float>(part));
    }
    for (const double part : region.kinetic_parts) {
      added.add_kinetic_energy_parts(static_cast<float>(part));
    }
  }
  header.set_given_triangle_regions(model.given_triangle_regions.data(),
                                    model.given_triangle_regions.size());
  header.mutable_mass_moments()->Assign(model.mass_moments.begin(), model.mass_moments.end());
}

v1::ModalModelRecord MakeHeader(const ModalModel& model, const ModelOrigin& origin) {
  v1::ModalModelRecord record;
  v1::ModalModelHeader& header = *record.mutable_header();
  header.set_format_version(kModelFormatVersion);
  header.set_solver(kSolver);
  *header.mutable_settings() = origin.settings;
  header.set_mesh_digest(origin.mesh_digest);
  header.set_node_count(static_cast<uint32_t>(model.node_count));
  header.set_element_count(static_cast<uint32_t>(model.element_count));
  header.set_mode_count(static_cast<uint32_t>(model.eigenvalues.size()));
  header.set_complete_to_eigenvalue(model.complete_to_eigenvalue);
  header.set_lowered_from_mode_count(static_cast<uint32_t>(model.lowered_from_mode_count));
  header.set_volume_m3(model.volume_m3);
  header.set_left_out_mode_count(static_cast<uint32_t>(model.left_out_mode_count));
  *header.mutable_verification() = ToProto(model.verification);
  for (const ArraySpec& spec : kModelArrays) {
    *header.add_arrays() = DescribeArray(spec, SizesOf(model));
  }
  AddRegions(model, header);
  for (const std::string& warning : model.warnings) header.add_warnings(warning);
  for (const double error : model.estimated_errors) {
    header.add_estimated_errors(static_cast<float>(error));
  }
  header.mutable_poisson_slopes()->Assign(model.poisson_slopes.begin(), model.poisson_slopes.end());
  return record;
}

}  // namespace

absl::Status WriteModalModel(const std::string& path, const ModalModel& model,
                             const ModelOrigin& origin) {
  const std::vector<std::array<float, 3>> given_vertices = ToFloat(model.given.vertices);
  const std::array<Bytes, kModelArrayCount> arrays = Arrays(model, given_vertices);
  return WriteRecordFile(path, MakeHeader(model, origin), arrays);
}

}  // namespace carillon::precompute
