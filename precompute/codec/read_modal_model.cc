// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/codec/read_modal_model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <limits>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "precompute/codec/record_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/model_format.h"
#include "proto/cpp/status_macros.h"

static_assert(std::endian::native == std::endian::little, "arrays are stored little endian");

namespace carillon::precompute {
namespace {

absl::Status Malformed(absl::string_view what) {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
      absl::StrCat("the modal model ", what, "; give a file that carillon-precompute wrote"));
}

/// Collects the records of one file.
class ModelReader {
 public:
  explicit ModelReader(uint64_t file_bytes) : file_bytes_(file_bytes) {}

  absl::Status Take(v1::ModalModelRecord& record) {
    if (record.has_header()) return TakeHeader(record.header());
    // Transfers may follow the model in an exported file.
    if (record.record_case() == v1::ModalModelRecord::kTransfer) return absl::OkStatus();
    return TakeChunk(record.chunk());
  }

  absl::StatusOr<StoredModel> Finish() && {
    ModalModel& model = stored_.model;
    for (size_t i = 0; i < kModelArrayCount; ++i) {
      if (read_bytes_[i] != arrays_[i].size()) return Malformed("is not complete");
    }
    if (model.eigenvalues.empty()) return Malformed("has no modes");
    const auto count = static_cast<int32_t>(model.vertices.size());
    for (const auto& triangle : model.triangles) {
      for (const int32_t v : triangle) {
        if (v < 0 || v >= count) return Malformed("has a triangle without its vertices");
      }
    }
    return std::move(stored_);
  }

 private:
  absl::Status TakeHeader(const v1::ModalModelHeader& header) {
    if (header.format_version() > kModelFormatVersion) return Malformed("has a newer format");
    if (has_header_) return Malformed("has two headers");
    has_header_ = true;
    if (header.arrays_size() < static_cast<int>(kModelArrayCount)) return Malformed("lacks arrays");
    const ModelSizes sizes{.modes = header.mode_count(),
                           .vertices = Length(header, "vertices"),
                           .triangles = Length(header, "triangles"),
                           .given_vertices = Length(header, "given_vertices"),
                           .given_triangles = Length(header, "given_triangles")};
    for (size_t i = 0; i < kModelArrayCount; ++i) {
      const v1::ArrayDescriptor expected = DescribeArray(kModelArrays[i], sizes);
      if (header.arrays(static_cast<int>(i)).SerializeAsString() != expected.SerializeAsString()) {
        return Malformed(absl::StrCat("has no array \"", kModelArrays[i].name, "\" in its place"));
      }
    }
    if (sizes.vertices > file_bytes_ || sizes.triangles > file_bytes_ ||
        sizes.given_vertices > file_bytes_ || sizes.given_triangles > file_bytes_ ||
        (sizes.vertices > 0 && sizes.modes > file_bytes_ / sizes.vertices)) {
      return Malformed("is not complete");
    }
    Describe(header);
    Allocate(sizes);
    return absl::OkStatus();
  }

  static uint64_t Length(const v1::ModalModelHeader& header, std::string_view name) {
    const int index = static_cast<int>(ModelArrayIndex(name));
    const v1::ArrayDescriptor& array = header.arrays(index);
    return array.shape_size() > 0 ? array.shape(0) : 0;
  }

  void Describe(const v1::ModalModelHeader& header) {
    stored_.origin = {.mesh_digest = header.mesh_digest(), .settings = header.settings()};
    ModalModel& model = stored_.model;
    model.node_count = static_cast<int>(header.node_count());
    model.element_count = static_cast<int>(header.element_count());
    model.volume_m3 = header.volume_m3();
    model.complete_to_eigenvalue = header.complete_to_eigenvalue();
    model.lowered_from_mode_count = static_cast<int>(header.lowered_from_mode_count());
    model.left_out_mode_count = static_cast<int>(header.left_out_mode_count());
    model.mass_moments.assign(header.mass_moments().begin(), header.mass_moments().end());
    for (const v1::ModalModelRegion& region : header.regions()) {
      const v1::RegionProperties& properties = region.properties();
      model.regions.push_back(
          {.material = {.region = properties.region(),
                        .elastic = {.young_pa = properties.relative_young(),
                                    .poisson_ratio = properties.poisson_ratio()},
                        .density_kg_per_m3 = properties.relative_density()},
           .strain_parts = {region.strain_energy_parts().begin(),
                            region.strain_energy_parts().end()},
           .kinetic_parts = {region.kinetic_energy_parts().begin(),
                             region.kinetic_energy_parts().end()}});
      model.regions.back().strain_parts.resize(header.mode_count());
      model.regions.back().kinetic_parts.resize(header.mode_count());
    }
    model.warnings.assign(header.warnings().begin(), header.warnings().end());
    model.estimated_errors.assign(header.estimated_errors().begin(),
                                  header.estimated_errors().end());
    model.poisson_slopes.assign(header.poisson_slopes().begin(), header.poisson_slopes().end());
    model.estimated_errors.resize(header.mode_count(), std::numeric_limits<double>::quiet_NaN());
  }

  void Allocate(const ModelSizes& sizes) {
    ModalModel& model = stored_.model;
    model.eigenvalues.resize(sizes.modes);
    model.residuals.resize(sizes.modes);
    model.couplings.resize(sizes.modes);
    model.vertices.resize(sizes.vertices);
    model.triangles.resize(sizes.triangles);
    model.shapes.resize(sizes.vertices * 3 * sizes.modes);
    unused_ = {std::vector<std::byte>(4 * sizes.triangles),
               std::vector<std::byte>(12 * sizes.given_vertices),
               std::vector<std::byte>(12 * sizes.given_triangles)};
    arrays_ = {std::as_writable_bytes(std::span(model.eigenvalues)),
               std::as_writable_bytes(std::span(model.residuals)),
               std::as_writable_bytes(std::span(model.couplings)),
               std::as_writable_bytes(std::span(model.vertices)),
               std::as_writable_bytes(std::span(model.triangles)),
               unused_[0],
               unused_[1],
               unused_[2],
               std::as_writable_bytes(std::span(model.shapes))};
  }

  absl::Status TakeChunk(const v1::ModalModelChunk& chunk) {
    if (!has_header_) return Malformed("has no header");
    const size_t i = chunk.array();
    // A newer writer may have added arrays that this reader does not know.
    if (i >= kModelArrayCount) return absl::OkStatus();
    const std::string& data = chunk.data();
    if (chunk.offset() != read_bytes_[i] || data.size() > arrays_[i].size() - read_bytes_[i]) {
      return Malformed(absl::StrCat("has a chunk of \"", kModelArrays[i].name, "\" out of place"));
    }
    std::memcpy(arrays_[i].data() + read_bytes_[i], data.data(), data.size());
    read_bytes_[i] += data.size();
    return absl::OkStatus();
  }

  uint64_t file_bytes_;
  bool has_header_ = false;
  StoredModel stored_;
  std::array<std::vector<std::byte>, 3> unused_;               ///< the surface as given
  std::array<std::span<std::byte>, kModelArrayCount> arrays_;  ///< where each array goes
  std::array<size_t, kModelArrayCount> read_bytes_ = {};
};

}  // namespace

absl::StatusOr<StoredModel> ReadModalModel(const std::string& path) {
  std::error_code none;
  ModelReader reader(std::filesystem::file_size(path, none));
  RETURN_IF_ERROR(
      ReadModelRecords(path, [&](v1::ModalModelRecord& record) { return reader.Take(record); }));
  return std::move(reader).Finish();
}

}  // namespace carillon::precompute
