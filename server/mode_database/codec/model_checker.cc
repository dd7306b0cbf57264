// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/model_checker.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/model_format.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"

namespace carillon {
namespace {

constexpr uint64_t kMaxDimension = 1ULL << 32;
constexpr uint64_t kMaxArrayBytes = 1ULL << 40;

const ArraySpec* FindSpec(const std::string& name) {
  const size_t index = ModelArrayIndex(name);
  return index == kModelArrayCount ? nullptr : &kModelArrays[index];
}

uint64_t ElementBytes(v1::ElementType type) {
  switch (type) {
    case v1::ELEMENT_TYPE_FLOAT32:
    case v1::ELEMENT_TYPE_UINT32:
      return 4;
    case v1::ELEMENT_TYPE_FLOAT64:
      return 8;
    default:
      return 0;
  }
}

absl::Status Malformed(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                 absl::StrCat("the records of the model are damaged: ", what,
                              "; write it anew with carillon-precompute or by an export"));
}

template <typename T, typename Test>
bool AllOf(std::string_view data, Test test) {
  for (size_t at = 0; at < data.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, data.data() + at, sizeof value);
    if (!test(value)) return false;
  }
  return true;
}

// By the exponent, without an early end, so that the compiler takes many at a time.
bool FloatsAreFinite(std::string_view data) {
  constexpr uint32_t kExponent = 0x7f800000;
  uint32_t not_finite = 0;
  for (size_t at = 0; at + sizeof(uint32_t) <= data.size(); at += sizeof(uint32_t)) {
    uint32_t bits;
    std::memcpy(&bits, data.data() + at, sizeof bits);
    not_finite |= static_cast<uint32_t>((bits & kExponent) == kExponent);
  }
  return not_finite == 0;
}

bool NumbersAreFinite(v1::ElementType type, std::string_view data) {
  if (type == v1::ELEMENT_TYPE_FLOAT32) return FloatsAreFinite(data);
  return type != v1::ELEMENT_TYPE_FLOAT64 ||
         AllOf<double>(data, [](double x) { return std::isfinite(x); });
}

}  // namespace

absl::Status ModelChecker::Check(const v1::ModalModelRecord& record) {
  if (record.has_header() && !has_header_) return CheckHeader(record.header());
  if (record.has_chunk() && has_header_) {
    const v1::ModalModelChunk& chunk = record.chunk();
    return CheckChunk({chunk.array(), chunk.offset(), chunk.xxh3(), chunk.data()});
  }
  return Malformed(has_header_ ? "a record after the header is not a chunk"
                               : "its first record is not a header");
}

absl::Status ModelChecker::CheckHeader(const v1::ModalModelHeader& header) {
  if (header.format_version() != kModelFormatVersion) {
    return Malformed(absl::StrCat("it has format version ", header.format_version()));
  }
  const double poisson = header.settings().poisson_ratio();
  if (!(poisson > -1 && poisson < 0.5)) {
    return Malformed(absl::StrCat("its Poisson's ratio is ", poisson));
  }
  if (!std::isfinite(header.complete_to_eigenvalue())) {
    return Malformed("complete_to_eigenvalue is not finite");
  }
  dimensions_['3'] = 3;
  dimensions_['m'] = header.mode_count();
  for (const v1::ArrayDescriptor& array : header.arrays()) {
    RETURN_IF_ERROR(CheckArray(array));
  }
  for (const ArraySpec& spec : kModelArrays) {
    const auto named = [&](const v1::ArrayDescriptor& array) { return array.name() == spec.name; };
    if (std::ranges::count_if(header.arrays(), named) != 1) {
      return Malformed(absl::StrCat("it needs one array \"", spec.name, "\""));
    }
  }
  RETURN_IF_ERROR(CheckRegions(header));
  header_ = header;
  has_header_ = true;
  return absl::OkStatus();
}

absl::Status ModelChecker::CheckRegions(const v1::ModalModelHeader& header) const {
  if (header.regions().empty()) return absl::OkStatus();
  const auto are_parts = [&](const auto& parts) {
    return static_cast<uint32_t>(parts.size()) == header.mode_count() &&
           std::ranges::all_of(parts, [](float part) { return part >= 0 && part <= 1; });
  };
  const auto is_ratio = [](double ratio) { return ratio > 0 && std::isfinite(ratio); };
  for (const v1::ModalModelRegion& region : header.regions()) {
    const v1::RegionProperties& properties = region.properties();
    if (!is_ratio(properties.relative_young()) || !is_ratio(properties.relative_density()) ||
        !(properties.poisson_ratio() > -1 && properties.poisson_ratio() < 0.5) ||
        !are_parts(region.strain_energy_parts()) || !are_parts(region.kinetic_energy_parts())) {
      return Malformed("a region has a figure that is impossible, or not one for each mode");
    }
  }
  const std::string& of_triangles = header.given_triangle_regions();
  const bool are_regions = std::ranges::all_of(of_triangles, [&](char region) {
    return static_cast<unsigned char>(region) < header.regions_size();
  });
  if (are_regions && of_triangles.size() == dimensions_.at('H') &&
      header.mass_moments_size() == 10 && is_ratio(header.mass_moments(0))) {
    return absl::OkStatus();
  }
  return Malformed("its regions have not one number for each given triangle, or no mass");
}

absl::Status ModelChecker::CheckArray(const v1::ArrayDescriptor& array) {
  uint64_t byte_count = ElementBytes(array.type());
  bool fits = byte_count > 0 && !array.shape().empty();
  for (const uint64_t size : array.shape()) {
    fits = fits && size > 0 && size <= kMaxDimension && byte_count <= kMaxArrayBytes / size;
    byte_count *= fits ? size : 1;
  }
  if (!fits) {
    return Malformed(absl::StrCat("array \"", array.name(), "\" has no type, no size or too much"));
  }
  byte_counts_.push_back(byte_count);
  return CheckShape(array);
}

absl::Status ModelChecker::CheckShape(const v1::ArrayDescriptor& array) {
  const ArraySpec* spec = FindSpec(array.name());
  if (spec == nullptr) return absl::OkStatus();  // of a later minor version: kept, not read
  const std::string letters = spec->shape;
  bool agrees =
      array.type() == spec->type && letters.size() == static_cast<size_t>(array.shape_size());
  for (int i = 0; agrees && i < array.shape_size(); ++i) {
    const auto [known, is_new] =
        dimensions_.emplace(letters[static_cast<size_t>(i)], array.shape(i));
    agrees = known->second == array.shape(i);
  }
  if (agrees) return absl::OkStatus();
  return Malformed(
      absl::StrCat("type or shape of array \"", array.name(), "\" disagrees with the others"));
}

absl::Status ModelChecker::CheckChunk(const ChunkView& chunk) {
  if (array_ == header_.arrays_size()) return Malformed("a chunk follows the last array");
  const v1::ArrayDescriptor& array = header_.arrays(array_);
  const std::string_view data = chunk.data;
  if (chunk.array != static_cast<uint32_t>(array_) || chunk.offset != offset_) {
    return Malformed(absl::StrCat("a chunk is missing or out of order: byte ", offset_,
                                  " of array \"", array.name(), "\" should follow"));
  }
  if (data.empty() || data.size() > kMaxModelChunkBytes ||
      data.size() % ElementBytes(array.type()) != 0 ||
      data.size() > byte_counts_[static_cast<size_t>(array_)] - offset_) {
    return Malformed(absl::StrCat("a chunk of array \"", array.name(), "\" has a wrong size, ",
                                  data.size(), " bytes"));
  }
  if (Xxh3(data) != chunk.xxh3) {
    return Refusal(absl::StatusCode::kDataLoss, "MODAL_MODEL_CORRUPT",
                   absl::StrCat("the hash of array \"", array.name(), "\" at byte ", offset_,
                                " is wrong, so its bytes have changed since they were computed: "
                                "decompose the mesh again, or import the model from a copy"));
  }
  RETURN_IF_ERROR(CheckNumbers(array, data));
  offset_ += data.size();
  if (offset_ == byte_counts_[static_cast<size_t>(array_)]) {
    ++array_;
    offset_ = 0;
  }
  return absl::OkStatus();
}

absl::Status ModelChecker::CheckNumbers(const v1::ArrayDescriptor& array, std::string_view data) {
  const ArraySpec* spec = FindSpec(array.name());
  if (spec == nullptr) return absl::OkStatus();
  bool good = NumbersAreFinite(array.type(), data);
  if (spec->index_bound != 0) {
    const uint64_t bound = dimensions_.at(spec->index_bound);
    good = AllOf<uint32_t>(data, [&](uint32_t index) { return index < bound; });
  }
  if (array.name() == "eigenvalues") {
    good = good && AllOf<double>(data, [&](double value) {
             const bool ascends = value > 0 && value >= last_eigenvalue_;
             last_eigenvalue_ = value;
             return ascends;
           });
  }
  if (array.name() == "vertices") CompareVertices(data);
  if (good) return absl::OkStatus();
  return Malformed(
      absl::StrCat("array \"", array.name(),
                   "\" has a number that is not finite, out of range or out of order"));
}

// A chunk may begin within a vertex.
void ModelChecker::CompareVertices(std::string_view data) {
  for (size_t at = 0; at < data.size() && !vertices_differ_; at += sizeof(float)) {
    float coordinate;
    std::memcpy(&coordinate, data.data() + at, sizeof coordinate);
    float& first = first_vertex_[coordinate_count_ % 3];
    if (coordinate_count_ < 3) first = coordinate;
    vertices_differ_ = coordinate != first;
    ++coordinate_count_;
  }
}

absl::Status ModelChecker::Finish() const {
  if (!has_header_) return Malformed("it is empty");
  if (array_ == header_.arrays_size()) {
    return vertices_differ_ ? absl::OkStatus() : Malformed("all its vertices are one point");
  }
  return Malformed(absl::StrCat("it ends at byte ", offset_, " of array \"",
                                header_.arrays(array_).name(), "\""));
}

uint64_t ModelChecker::array_bytes() const {
  uint64_t sum = 0;
  for (const uint64_t byte_count : byte_counts_) sum += byte_count;
  return sum;
}

}  // namespace carillon
