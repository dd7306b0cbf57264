// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/model_codec.h"

#include <fcntl.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/model_format.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"

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
std::string_view Bytes(const Vector& values) {
  return {reinterpret_cast<const char*>(values.data()),
          values.size() * sizeof(typename Vector::value_type)};
}

// The numbers of each of kModelArrays.
std::array<std::string_view, kModelArrayCount> Fields(const ModalModel& model,
                                                      const std::vector<double>& residuals) {
  return {Bytes(model.eigenvalues),    Bytes(residuals),
          Bytes(model.couplings),      Bytes(model.vertices),
          Bytes(model.triangles),      Bytes(model.given_triangle),
          Bytes(model.given_vertices), Bytes(model.given_triangles),
          Bytes(model.shapes)};
}

ModelSizes SizesOf(const ModalModel& model) {
  return {.modes = model.eigenvalues.size(),
          .vertices = model.vertices.size(),
          .triangles = model.triangles.size(),
          .given_vertices = model.given_vertices.size(),
          .given_triangles = model.given_triangles.size()};
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

v1::ModalModelRecord HeaderRecord(const ModelSizes& sizes, v1::ModalModelHeader header) {
  header.clear_arrays();
  for (const ArraySpec& spec : kModelArrays) *header.add_arrays() = DescribeArray(spec, sizes);
  v1::ModalModelRecord record;
  *record.mutable_header() = std::move(header);
  return record;
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

absl::Status EncodeModel(const ModalModel& model, v1::ModalModelHeader header,
                         const std::vector<double>& residuals,
                         absl::FunctionRef<absl::Status(const v1::ModalModelRecord&)> sink) {
  header.set_mode_count(static_cast<uint32_t>(model.mode_count()));
  const auto fields = Fields(model, residuals);
  absl::Status status = sink(HeaderRecord(SizesOf(model), std::move(header)));
  for (size_t i = 0; status.ok() && i < fields.size(); ++i) {
    const std::string_view bytes = fields[i];
    for (size_t offset = 0; status.ok() && offset < bytes.size(); offset += kMaxModelChunkBytes) {
      const std::string_view data = bytes.substr(offset, kMaxModelChunkBytes);
      v1::ModalModelRecord record;
      v1::ModalModelChunk& chunk = *record.mutable_chunk();
      chunk.set_array(static_cast<uint32_t>(i));
      chunk.set_offset(offset);
      chunk.set_data(data.data(), data.size());
      chunk.set_xxh3(Xxh3(data));
      status = sink(record);
    }
  }
  return status;
}

absl::StatusOr<ModalModel> ReadModelFile(const std::filesystem::path& file,
                                         const std::string& digest) {
  ASSIGN_OR_RETURN(ModelFileReader reader, ModelFileReader::Open(file));
  ModelDecoder decoder;
  while (true) {
    ASSIGN_OR_RETURN(const auto record, reader.Next());
    if (!record.has_value()) return decoder.Finish(digest);
    RETURN_IF_ERROR(decoder.Append(*record));
  }
}

}  // namespace carillon
