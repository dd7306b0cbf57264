// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_accessor.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/status_macros.h"

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little endian");

namespace carillon::interchange {
namespace {

using nlohmann::json;

// The types of components, as glTF numbers them.
constexpr uint64_t kByte = 5121, kShort = 5123, kInt = 5125, kFloat = 5126;

/// The bytes of the elements of an accessor in a buffer.
struct Pieces {
  std::string_view bytes;  ///< from the first piece on
  uint64_t component = 0;
  uint64_t count = 0;
  uint64_t stride = 0;
};

uint64_t ComponentBytes(uint64_t component) {
  switch (component) {
    case kByte:
      return 1;
    case kShort:
      return 2;
    case kInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

uint64_t Or(const json& value, uint64_t absent) {
  return value.is_null() ? absent : Whole(value).value_or(UINT64_MAX);
}

/// Returns whether `count` elements of `size` bytes at the distance `stride` lie within `bytes`
/// from `offset` on. The check does not overflow.
bool Fits(uint64_t bytes, uint64_t offset, uint64_t count, uint64_t stride, uint64_t size) {
  if (offset > bytes || size > bytes - offset || stride == 0) return false;
  return (count - 1) <= (bytes - offset - size) / stride;
}

absl::StatusOr<std::string_view> View(GltfDocument& file, uint64_t index) {
  const json& views = Member(file.root(), "bufferViews");
  const bool known = views.is_array() && index < views.size();
  const auto buffer = known ? Whole(Member(views[index], "buffer")) : std::nullopt;
  if (!buffer) return Malformed(absl::StrCat("there is no buffer view ", index));
  ASSIGN_OR_RETURN(const std::string_view bytes, file.Buffer(*buffer));
  const uint64_t offset = Or(Member(views[index], "byteOffset"), 0);
  const uint64_t length = Or(Member(views[index], "byteLength"), UINT64_MAX);
  if (offset > bytes.size() || length > bytes.size() - offset) {
    return Malformed(absl::StrCat("buffer view ", index, " reaches beyond its buffer of ",
                                  bytes.size(), " bytes"));
  }
  return bytes.substr(offset, length);
}

absl::Status Bad(const std::string& name, absl::string_view what) {
  return Malformed(absl::StrCat("\"", name, "\" ", what));
}

absl::StatusOr<Pieces> Find(GltfDocument& file, const json& property, const std::string& name,
                            const std::string& type) {
  const json& accessors = Member(file.root(), "accessors");
  const auto index = Whole(property);
  if (!index || !accessors.is_array() || *index >= accessors.size()) {
    return Bad(name, "names no accessor");
  }
  const json& accessor = accessors[*index];
  if (Text(Member(accessor, "type")) != type)
    return Bad(name, absl::StrCat("must be of type ", type));
  const auto view = Whole(Member(accessor, "bufferView"));
  if (!view || accessor.contains("sparse")) {
    return Bad(name,
               "has an accessor that is sparse, compressed or without data, which is not read");
  }
  ASSIGN_OR_RETURN(const std::string_view bytes, View(file, *view));
  Pieces pieces;
  pieces.component = Or(Member(accessor, "componentType"), 0);
  pieces.count = Or(Member(accessor, "count"), 0);
  const uint64_t size = ComponentBytes(pieces.component) * (type == "VEC3" ? 3 : 1);
  if (size == 0) return Bad(name, "has a component type that is not read");
  pieces.stride = Or(Member(Member(file.root(), "bufferViews")[*view], "byteStride"), size);
  const uint64_t offset = Or(Member(accessor, "byteOffset"), 0);
  if (pieces.count == 0 || pieces.stride < size ||
      !Fits(bytes.size(), offset, pieces.count, pieces.stride, size)) {
    return Bad(name, absl::StrCat("has an accessor of ", pieces.count,
                                  " pieces that does not fit into its buffer view"));
  }
  pieces.bytes = bytes.substr(offset);
  return pieces;
}

template <class From>
std::vector<uint32_t> Widen(const Pieces& pieces) {
  std::vector<uint32_t> numbers(pieces.count);
  for (uint64_t i = 0; i < pieces.count; ++i) {
    From number;
    std::memcpy(&number, pieces.bytes.data() + i * pieces.stride, sizeof number);
    numbers[i] = number;
  }
  return numbers;
}

/// Returns the least (or the greatest) value of each component of vectors.
template <class Better>
json Extreme(const std::vector<float>& numbers, Better better) {
  json extreme = {numbers[0], numbers[1], numbers[2]};
  for (size_t i = 3; i < numbers.size(); ++i) {
    if (better(numbers[i], extreme[i % 3].get<float>())) extreme[i % 3] = numbers[i];
  }
  return extreme;
}

}  // namespace

absl::StatusOr<std::vector<float>> ReadFloats(GltfDocument& file, const json& property,
                                              const std::string& name, const std::string& type) {
  ASSIGN_OR_RETURN(const Pieces pieces, Find(file, property, name, type));
  if (pieces.component != kFloat) return Bad(name, "must hold floats");
  const size_t width = type == "VEC3" ? 3 : 1;
  std::vector<float> numbers(pieces.count * width);
  for (uint64_t i = 0; i < pieces.count; ++i) {
    std::memcpy(&numbers[i * width], pieces.bytes.data() + i * pieces.stride,
                width * sizeof(float));
  }
  return numbers;
}

absl::StatusOr<std::vector<uint32_t>> ReadIndices(GltfDocument& file, const json& property,
                                                  const std::string& name) {
  ASSIGN_OR_RETURN(const Pieces pieces, Find(file, property, name, "SCALAR"));
  switch (pieces.component) {
    case kByte:
      return Widen<uint8_t>(pieces);
    case kShort:
      return Widen<uint16_t>(pieces);
    case kInt:
      return Widen<uint32_t>(pieces);
    default:
      return Bad(name, "must hold whole numbers");
  }
}

size_t AccessorWriter::Add(const std::vector<float>& numbers, const std::string& type,
                           Target target) {
  json accessor = {{"bufferView", AddView(numbers.data(), numbers.size() * sizeof(float), target)},
                   {"componentType", kFloat},
                   {"count", numbers.size() / (type == "VEC3" ? 3 : 1)},
                   {"type", type}};
  if (target == Target::kVertices) {
    accessor["min"] = Extreme(numbers, std::less());
    accessor["max"] = Extreme(numbers, std::greater());
  }
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

size_t AccessorWriter::Add(const std::vector<uint32_t>& numbers, Target target) {
  accessors_.push_back(
      {{"bufferView", AddView(numbers.data(), numbers.size() * sizeof(uint32_t), target)},
       {"componentType", kInt},
       {"count", numbers.size()},
       {"type", "SCALAR"}});
  return accessors_.size() - 1;
}

size_t AccessorWriter::AddView(const void* data, size_t byte_count, Target target) {
  // All arrays hold numbers of four bytes, so each begins at a multiple of four, as glTF demands.
  json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", byte_count}};
  if (target != Target::kNone) view["target"] = static_cast<int>(target);
  bytes_.append(static_cast<const char*>(data), byte_count);
  views_.push_back(std::move(view));
  return views_.size() - 1;
}

}  // namespace carillon::interchange
