// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modal_model_codec.h"

#include <fcntl.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <span>

#include "absl/strings/str_cat.h"
#include "precompute/fixture_codec.h"
#include "proto/cpp/error_reason.h"

static_assert(std::endian::native == std::endian::little, "arrays are stored little endian");

namespace carillon::precompute {
namespace {

constexpr double kBytesPerGib = 1024.0 * 1024 * 1024;

using google::protobuf::io::FileOutputStream;
using google::protobuf::util::SerializeDelimitedToZeroCopyStream;

constexpr uint32_t kFormatVersion = 1;
constexpr size_t kMaxChunkBytes = 1 << 20;
constexpr char kSolver[] = "carillon-precompute " CARILLON_VERSION;

/// One array: its descriptor and its bytes, which the model owns.
struct StoredArray {
  v1::ArrayDescriptor descriptor;
  std::span<const std::byte> bytes;
};

template <typename T>
StoredArray Describe(const char* name, v1::ElementType type, std::vector<uint64_t> shape,
                     const std::vector<T>& values) {
  StoredArray array{.descriptor = {}, .bytes = std::as_bytes(std::span(values))};
  array.descriptor.set_name(name);
  array.descriptor.set_type(type);
  array.descriptor.mutable_shape()->Assign(shape.begin(), shape.end());
  return array;
}

std::vector<std::array<float, 3>> ToFloat(const std::vector<Point>& points) {
  std::vector<std::array<float, 3>> result;
  result.reserve(points.size());
  for (const auto& [x, y, z] : points) {
    result.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  }
  return result;
}

std::vector<StoredArray> Arrays(const ModalModel& model,
                                const std::vector<std::array<float, 3>>& given_vertices) {
  using enum v1::ElementType;
  const uint64_t modes = model.eigenvalues.size();
  const uint64_t vertices = model.vertices.size();
  const uint64_t triangles = model.triangles.size();
  const uint64_t given_triangles = model.given.triangles.size();
  return {
      Describe("eigenvalues", ELEMENT_TYPE_FLOAT64, {modes}, model.eigenvalues),
      Describe("residuals", ELEMENT_TYPE_FLOAT64, {modes}, model.residuals),
      Describe("couplings", ELEMENT_TYPE_FLOAT64, {modes}, model.couplings),
      Describe("vertices", ELEMENT_TYPE_FLOAT32, {vertices, 3}, model.vertices),
      Describe("triangles", ELEMENT_TYPE_UINT32, {triangles, 3}, model.triangles),
      Describe("given_triangle", ELEMENT_TYPE_UINT32, {triangles}, model.given_triangle),
      Describe("given_vertices", ELEMENT_TYPE_FLOAT32, {given_vertices.size(), 3}, given_vertices),
      Describe("given_triangles", ELEMENT_TYPE_UINT32, {given_triangles, 3}, model.given.triangles),
      Describe("shapes", ELEMENT_TYPE_FLOAT32, {vertices, 3, modes}, model.shapes),
  };
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

v1::ModalModelRecord MakeHeader(const ModalModel& model, const ModelOrigin& origin,
                                const std::vector<StoredArray>& arrays) {
  v1::ModalModelRecord record;
  v1::ModalModelHeader& header = *record.mutable_header();
  header.set_format_version(kFormatVersion);
  header.set_solver(kSolver);
  *header.mutable_settings() = origin.settings;
  header.set_mesh_digest(origin.mesh_digest);
  header.set_node_count(static_cast<uint32_t>(model.node_count));
  header.set_element_count(static_cast<uint32_t>(model.element_count));
  header.set_mode_count(static_cast<uint32_t>(model.eigenvalues.size()));
  header.set_complete_to_eigenvalue(model.complete_to_eigenvalue);
  header.set_volume_m3(model.volume_m3);
  header.set_left_out_mode_count(static_cast<uint32_t>(model.left_out_mode_count));
  *header.mutable_verification() = ToProto(model.verification);
  for (const StoredArray& array : arrays) *header.add_arrays() = array.descriptor;
  for (const std::string& warning : model.warnings) header.add_warnings(warning);
  for (const double error : model.estimated_errors) {
    header.add_estimated_errors(static_cast<float>(error));
  }
  return record;
}

bool WriteChunks(const StoredArray& array, uint32_t index, FileOutputStream& file) {
  for (size_t offset = 0; offset < array.bytes.size(); offset += kMaxChunkBytes) {
    const auto piece =
        array.bytes.subspan(offset, std::min(kMaxChunkBytes, array.bytes.size() - offset));
    v1::ModalModelRecord record;
    v1::ModalModelChunk& chunk = *record.mutable_chunk();
    chunk.set_array(index);
    chunk.set_offset(offset);
    chunk.set_data(piece.data(), piece.size());
    chunk.set_xxh3(XXH3_64bits(piece.data(), piece.size()));
    if (!SerializeDelimitedToZeroCopyStream(record, &file)) return false;
  }
  return true;
}

/// Writes all records and brings them to the disk.
bool WriteRecords(int descriptor, const v1::ModalModelRecord& header,
                  const std::vector<StoredArray>& arrays) {
  FileOutputStream file(descriptor);
  bool ok = SerializeDelimitedToZeroCopyStream(header, &file);
  for (size_t i = 0; i < arrays.size() && ok; ++i) {
    ok = WriteChunks(arrays[i], static_cast<uint32_t>(i), file);
  }
  ok = ok && file.Flush() && fsync(descriptor) == 0;
  return file.Close() && ok;
}

}  // namespace

v1::DecompositionSettings ToProto(const MeshFile& file, const DecompositionSettings& settings) {
  v1::DecompositionSettings result;
  result.set_poisson_ratio(settings.poisson_ratio);
  result.set_element(settings.meshing.nodes_per_element == 4 ? v1::ELEMENT_LINEAR
                                                             : v1::ELEMENT_QUADRATIC);
  result.set_mass_matrix(settings.mass == MassSharing::kLumped ? v1::MASS_MATRIX_LUMPED
                                                               : v1::MASS_MATRIX_CONSISTENT);
  result.set_metres_per_unit(file.metres_per_unit);
  v1::MeshSettings& mesh = *result.mutable_mesh();
  if (settings.meshing.keep_surface) mesh.set_keep_surface(*settings.meshing.keep_surface);
  mesh.set_repair(settings.preparation.repair);
  mesh.set_wall_m(settings.preparation.wall_m);
  mesh.set_accuracy(settings.resolution.accuracy);
  mesh.set_budget_s(settings.resolution.budget_s);
  mesh.set_budget_gib(settings.resolution.budget_bytes / kBytesPerGib);
  mesh.set_target_node_count(static_cast<uint32_t>(settings.meshing.target_node_count));
  result.set_keep_mode_count(static_cast<uint32_t>(settings.keep_mode_count));
  for (const Fixture& fixture : settings.fixtures) *result.add_fixtures() = ToProto(fixture);
  return result;
}

absl::Status WriteModalModel(const std::string& path, const ModalModel& model,
                             const ModelOrigin& origin) {
  const std::vector<std::array<float, 3>> given_vertices = ToFloat(model.given.vertices);
  const std::vector<StoredArray> arrays = Arrays(model, given_vertices);
  const std::string temporary = absl::StrCat(path, ".partial-", getpid());
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor >= 0 && WriteRecords(descriptor, MakeHeader(model, origin, arrays), arrays) &&
      std::rename(temporary.c_str(), path.c_str()) == 0) {
    return absl::OkStatus();
  }
  unlink(temporary.c_str());
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat("\"", path,
                              "\" cannot be written; check that its folder exists, is "
                              "writable and has room"));
}

}  // namespace carillon::precompute
