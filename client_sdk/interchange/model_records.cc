// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/model_records.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/status_macros.h"

static_assert(std::endian::native == std::endian::little, "arrays are stored little endian");

namespace carillon::interchange {
namespace {

v1::ElementType TypeOf(double) { return v1::ELEMENT_TYPE_FLOAT64; }
v1::ElementType TypeOf(float) { return v1::ELEMENT_TYPE_FLOAT32; }
v1::ElementType TypeOf(uint32_t) { return v1::ELEMENT_TYPE_UINT32; }

template <class T>
bool AppendBytes(std::vector<T>& numbers, const v1::ModalModelChunk& chunk) {
  const std::string& data = chunk.data();
  const size_t count = numbers.size();
  if (chunk.offset() != count * sizeof(T) || data.size() % sizeof(T) != 0) return false;
  numbers.resize(count + data.size() / sizeof(T));
  std::memcpy(numbers.data() + count, data.data(), data.size());
  return true;
}

v1::ModalModelRecord HeaderRecord(const StoredModel& model) {
  v1::ModalModelRecord record;
  v1::ModalModelHeader& header = *record.mutable_header();
  header = model.header;
  header.set_format_version(kModelFormatVersion);
  header.set_mode_count(static_cast<uint32_t>(model.mode_count()));
  header.clear_arrays();
  VisitArrays(model, [&]<class T>(const char* name, const std::vector<T>&, const char* dimensions) {
    v1::ArrayDescriptor& array = *header.add_arrays();
    array.set_name(name);
    array.set_type(TypeOf(T()));
    const std::vector<uint64_t> shape = Shape(model, dimensions);
    array.mutable_shape()->Assign(shape.begin(), shape.end());
  });
  return record;
}

v1::ModalModelRecord ChunkRecord(uint32_t array, size_t offset, std::string_view data) {
  v1::ModalModelRecord record;
  v1::ModalModelChunk& chunk = *record.mutable_chunk();
  chunk.set_array(array);
  chunk.set_offset(offset);
  chunk.set_data(data.data(), data.size());
  chunk.set_xxh3(XXH3_64bits(data.data(), data.size()));
  return record;
}

}  // namespace

absl::Status ModelAssembler::Append(const v1::ModalModelRecord& record) {
  if (record.has_chunk()) return AppendChunk(record.chunk());
  // Transfers may follow the model; other formats have no place for them.
  if (record.has_header()) model_.header = record.header();
  return absl::OkStatus();
}

absl::Status ModelAssembler::AppendChunk(const v1::ModalModelChunk& chunk) {
  const auto& arrays = model_.header.arrays();
  if (chunk.array() >= static_cast<uint32_t>(arrays.size())) {
    return Malformed("a chunk belongs to no array");
  }
  const std::string& name = arrays[static_cast<int>(chunk.array())].name();
  bool fits = true;
  VisitArrays(model_, [&](const char* known, auto& numbers, const char*) {
    if (name == known) fits = AppendBytes(numbers, chunk);
  });
  if (fits) return absl::OkStatus();
  return Malformed(absl::StrCat("a chunk of \"", name, "\" is missing or has a wrong size"));
}

absl::StatusOr<StoredModel> ModelAssembler::Finish() {
  RETURN_IF_ERROR(Validate(model_));
  return std::move(model_);
}

absl::Status SendRecords(const StoredModel& model,
                         const std::function<absl::Status(const v1::ModalModelRecord&)>& sink) {
  absl::Status status = sink(HeaderRecord(model));
  uint32_t index = 0;
  VisitArrays(model, [&](const char*, const auto& numbers, const char*) {
    const std::string_view bytes(reinterpret_cast<const char*>(numbers.data()),
                                 numbers.size() * sizeof(numbers[0]));
    for (size_t at = 0; status.ok() && at < bytes.size(); at += kMaxModelChunkBytes) {
      status = sink(ChunkRecord(index, at, bytes.substr(at, kMaxModelChunkBytes)));
    }
    ++index;
  });
  return status;
}

}  // namespace carillon::interchange
