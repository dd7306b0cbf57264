// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/model_codec.h"

#include <fcntl.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr uint32_t kMaxRecordBytes = 2 << 20;  // a chunk, or a header with many warnings

absl::Status Truncated() {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
      "the file is not a sequence of modal model records, or is cut short: copy it again");
}

absl::Status TooLong(uint32_t byte_count) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                 absl::StrCat("a record has ", byte_count, " bytes; at most ", kMaxRecordBytes,
                              " are allowed: shorten the warnings of its header, or copy the file "
                              "again if it is damaged"));
}

template <typename Vector>
char* Resize(Vector& values, uint64_t count) {
  values.resize(count);
  return reinterpret_cast<char*>(values.data());
}

// Where the bytes of an array go; the first dimension of all but "shapes" is its count of elements.
char* Destination(ModalModel& model, const v1::ArrayDescriptor& array) {
  const uint64_t count = array.shape(0);
  if (array.name() == "eigenvalues") return Resize(model.eigenvalues, count);
  if (array.name() == "couplings") return Resize(model.couplings, count);
  if (array.name() == "vertices") return Resize(model.vertices, count);
  if (array.name() == "triangles") return Resize(model.triangles, count);
  if (array.name() == "given_triangle") return Resize(model.given_triangle, count);
  if (array.name() == "given_vertices") return Resize(model.given_vertices, count);
  if (array.name() == "given_triangles") return Resize(model.given_triangles, count);
  if (array.name() == "shapes") return Resize(model.shapes, count * 3 * array.shape(2));
  return nullptr;
}

}  // namespace

struct ModelFileReader::State {
  explicit State(int descriptor) : stream(descriptor) {}
  google::protobuf::io::FileInputStream stream;
};

ModelFileReader::ModelFileReader(int descriptor) : state_(std::make_unique<State>(descriptor)) {}
ModelFileReader::ModelFileReader(ModelFileReader&&) noexcept = default;
ModelFileReader& ModelFileReader::operator=(ModelFileReader&&) noexcept = default;
ModelFileReader::~ModelFileReader() = default;

absl::StatusOr<ModelFileReader> ModelFileReader::Open(const std::filesystem::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    const std::string why = std::generic_category().message(errno);
    return Refusal(
        absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
        absl::StrCat(file.string(), " cannot be read (", why, "): see its name and rights"));
  }
  ModelFileReader reader(descriptor);
  reader.state_->stream.SetCloseOnDelete(true);
  return reader;
}

absl::StatusOr<std::optional<v1::ModalModelRecord>> ModelFileReader::Next() {
  google::protobuf::io::CodedInputStream in(&state_->stream);
  uint32_t byte_count = 0;
  if (!in.ReadVarint32(&byte_count)) {
    if (in.CurrentPosition() == 0 && state_->stream.GetErrno() == 0) return std::nullopt;
    return Truncated();
  }
  if (byte_count > kMaxRecordBytes) return TooLong(byte_count);
  const auto limit = in.PushLimit(static_cast<int>(byte_count));
  v1::ModalModelRecord record;
  if (!record.MergeFromCodedStream(&in) || !in.ConsumedEntireMessage() ||
      in.BytesUntilLimit() != 0) {
    return Truncated();
  }
  in.PopLimit(limit);
  return record;
}

std::string Delimited(const v1::ModalModelRecord& record) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream out(&stream);
  out.WriteVarint32(static_cast<uint32_t>(record.ByteSizeLong()));
  record.SerializeWithCachedSizes(&out);
  out.Trim();
  return bytes;
}

absl::Status ModelDecoder::Append(const v1::ModalModelRecord& record) {
  RETURN_IF_ERROR(checker_.Check(record));
  if (record.has_header()) {
    MakeRoom(record.header());
  } else {
    const v1::ModalModelChunk& chunk = record.chunk();
    Take({chunk.array(), chunk.offset(), chunk.xxh3(), chunk.data()});
  }
  return absl::OkStatus();
}

absl::Status ModelDecoder::AppendChunk(const ChunkView& chunk) {
  absl::Status status = checker_.CheckChunk(chunk);
  if (status.ok()) Take(chunk);
  return status;
}

void ModelDecoder::Take(const ChunkView& chunk) {
  char* const destination = destinations_[chunk.array];
  if (destination == nullptr) return;
  std::memcpy(destination + chunk.offset, chunk.data.data(), chunk.data.size());
}

void ModelDecoder::MakeRoom(const v1::ModalModelHeader& header) {
  model_.poisson_ratio = header.settings().poisson_ratio();
  model_.complete_to_eigenvalue = header.complete_to_eigenvalue();
  const auto& slopes = header.poisson_slopes();
  model_.poisson_slopes.assign(slopes.begin(), slopes.end());
  for (const v1::ModalModelRegion& region : header.regions()) {
    const v1::RegionProperties& properties = region.properties();
    const auto& strain = region.strain_energy_parts();
    const auto& kinetic = region.kinetic_energy_parts();
    model_.regions.push_back({.name = properties.region(),
                              .relative_young = properties.relative_young(),
                              .relative_density = properties.relative_density(),
                              .poisson_ratio = properties.poisson_ratio(),
                              .strain_energy_parts = {strain.begin(), strain.end()},
                              .kinetic_energy_parts = {kinetic.begin(), kinetic.end()}});
  }
  const std::string& of_triangles = header.given_triangle_regions();
  model_.given_triangle_regions.assign(of_triangles.begin(), of_triangles.end());
  if (!model_.regions.empty()) model_.mass_kg = header.mass_moments(0);
  for (const v1::ArrayDescriptor& array : header.arrays()) {
    destinations_.push_back(Destination(model_, array));
  }
}

absl::StatusOr<ModalModel> ModelDecoder::Finish(const std::string& digest) {
  RETURN_IF_ERROR(checker_.Finish());
  model_.digest = digest;
  return std::move(model_);
}

}  // namespace carillon
