// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/model_format.h"
#include "server/base/xxh3.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/model_codec.h"

namespace carillon {

/// A folder of its own for each object, gone with it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = std::filesystem::temp_directory_path() / "carillon-test-XXXXXX";
    path_ = mkdtemp(name.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A model whose numbers mean nothing but obey every rule of the stored form: a tetrahedron given,
/// `vertex_count` points on its sounding surface.
inline ModalModel SampleModel(size_t mode_count, size_t vertex_count) {
  ModalModel model;
  model.poisson_ratio = 0.33;
  model.complete_to_eigenvalue = 1e6;
  for (size_t i = 0; i < mode_count; ++i) {
    model.eigenvalues.push_back(1000.5 + static_cast<double>(i));
    model.couplings.push_back(0.25 * static_cast<double>(i));
  }
  for (size_t i = 0; i < vertex_count; ++i) {
    model.vertices.push_back({static_cast<float>(i), 0.5F, -1.0F});
  }
  model.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  model.given_triangle = {0, 1, 2, 3};
  model.given_vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  model.given_triangles = model.triangles;
  for (size_t i = 0; i < vertex_count * 3 * mode_count; ++i) {
    model.shapes.push_back(static_cast<float>(i) * 0.001F);
  }
  return model;
}

/// What goes with SampleModel.
inline v1::ModalModelHeader SampleHeader(const ModalModel& model) {
  v1::ModalModelHeader header;
  header.set_format_version(1);
  header.set_solver("sample 1.0");
  header.mutable_settings()->set_poisson_ratio(model.poisson_ratio);
  header.set_complete_to_eigenvalue(model.complete_to_eigenvalue);
  return header;
}

/// Its records, in order.
inline std::vector<v1::ModalModelRecord> SampleRecords(const ModalModel& model) {
  const std::vector<double> residuals(model.mode_count(), 1e-9);
  const auto bytes = [](const auto& values) {
    return absl::string_view(reinterpret_cast<const char*>(values.data()),
                             values.size() * sizeof(values[0]));
  };
  const std::array<absl::string_view, kModelArrayCount> arrays = {
      bytes(model.eigenvalues),    bytes(residuals),
      bytes(model.couplings),      bytes(model.vertices),
      bytes(model.triangles),      bytes(model.given_triangle),
      bytes(model.given_vertices), bytes(model.given_triangles),
      bytes(model.shapes)};
  std::vector<v1::ModalModelRecord> records(1);
  v1::ModalModelHeader& header = *records[0].mutable_header();
  header = SampleHeader(model);
  header.set_mode_count(static_cast<uint32_t>(model.mode_count()));
  const ModelSizes sizes{.modes = model.mode_count(),
                         .vertices = model.vertices.size(),
                         .triangles = model.triangles.size(),
                         .given_vertices = model.given_vertices.size(),
                         .given_triangles = model.given_triangles.size()};
  for (const ArraySpec& spec : kModelArrays) *header.add_arrays() = DescribeArray(spec, sizes);
  for (uint32_t i = 0; i < arrays.size(); ++i) {
    for (size_t at = 0; at < arrays[i].size(); at += kMaxModelChunkBytes) {
      v1::ModalModelChunk& chunk = *records.emplace_back().mutable_chunk();
      chunk.set_array(i);
      chunk.set_offset(at);
      chunk.set_data(std::string(arrays[i].substr(at, kMaxModelChunkBytes)));
      chunk.set_xxh3(Xxh3(chunk.data()));
    }
  }
  return records;
}

/// Reads the model of a file, or returns the error of the codec.
inline absl::StatusOr<ModalModel> ReadModelFile(const std::filesystem::path& file,
                                                const std::string& digest) {
  absl::StatusOr<ModelFileReader> reader = ModelFileReader::Open(file);
  if (!reader.ok()) return reader.status();
  ModelDecoder decoder;
  while (true) {
    const auto record = reader->Next();
    if (!record.ok()) return record.status();
    if (!record->has_value()) return decoder.Finish(digest);
    if (absl::Status status = decoder.Append(**record); !status.ok()) return status;
  }
}

inline void WriteRecords(const std::filesystem::path& file,
                         const std::vector<v1::ModalModelRecord>& records) {
  std::ofstream out(file, std::ios::binary);
  for (const v1::ModalModelRecord& record : records) out << Delimited(record);
}

inline std::string ReadBytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void WriteBytes(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace carillon
