// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/gltf/gltf_document.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf_uri.h"
#include "proto/cpp/program/escaped_text.h"

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little endian");

namespace carillon {
namespace {

using Json = nlohmann::json;

/// Numbers of an accessor that has no bytes of its own but those that it changes.
constexpr size_t kMostZeros = 100'000'000;

/// Extensions that change what a surface looks like, sounds like or carries, but not its shape.
constexpr std::string_view kHarmless[] = {"KHR_materials_",
                                          "KHR_texture_",
                                          "EXT_texture_",
                                          "MSFT_texture_",
                                          "KHR_lights_",
                                          "EXT_lights_",
                                          "KHR_xmp",
                                          "KHR_audio",
                                          "KHR_physics",
                                          "KHR_implicit_shapes",
                                          "KHR_mesh_quantization",
                                          "KHR_animation_pointer",
                                          "EXT_mesh_features",
                                          "EXT_structural_metadata",
                                          "EXT_instance_features",
                                          "MSFT_packing_",
                                          "KHR_techniques_webgl",
                                          "CESIUM_primitive_outline"};

std::string WayOut(std::string_view extension) {
  if (extension.find("meshopt") != std::string_view::npos) {
    return "decompress it (\"gltfpack -i IN -o OUT -noq\"), or export the body again uncompressed";
  }
  if (extension.find("draco") != std::string_view::npos) {
    return "re-export the body uncompressed (in Blender leave \"Compression\" off; "
           "\"gltf-pipeline -i IN -o OUT\" decompresses a file)";
  }
  if (extension.find("instancing") != std::string_view::npos) {
    return "write its instances as nodes (\"gltf-transform uninstance IN OUT\")";
  }
  return "export the body again without it";
}

/// The chunks of a binary asset.
struct Chunks {
  std::string_view json;
  std::string_view binary;
};

Chunks Split(std::string_view bytes) {
  constexpr size_t kHeader = 12, kChunkHeader = 8, kVersionAt = 4, kLengthAt = 8;
  constexpr uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  if (bytes.size() < kHeader + kChunkHeader || number(kLengthAt) > bytes.size()) {
    throw GltfFault("the file is cut short: copy it again");
  }
  if (number(kVersionAt) != 2) {
    throw GltfFault(absl::StrCat("its version is ", number(kVersionAt), ": export it as glTF 2.0"));
  }
  Chunks chunks;
  for (size_t at = kHeader; at + kChunkHeader <= bytes.size();) {
    const size_t length = number(at), left = bytes.size() - at - kChunkHeader;
    if (length > left) {
      throw GltfFault(absl::StrCat("the chunk at byte ", at, " says that it has ", length,
                                   " bytes, and the file has ", left, " more: copy it again"));
    }
    const uint32_t kind = number(at + 4);
    const std::string_view chunk = bytes.substr(at + kChunkHeader, length);
    if (kind == kJson && at == kHeader) chunks.json = chunk;
    if (kind == kBinary && chunks.binary.empty()) chunks.binary = chunk;
    at += kChunkHeader + length;
  }
  return chunks;
}

size_t SizeOfComponent(int type) {
  if (type == 5120 || type == 5121) return 1;
  if (type == 5122 || type == 5123) return 2;
  if (type == 5125 || type == 5126) return 4;
  throw GltfFault(absl::StrCat("an accessor has the component type ", type));
}

size_t WidthOf(absl::string_view type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC2") return 2;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  if (type == "MAT4") return 16;
  throw GltfFault(absl::StrCat("an accessor has the type ", QuotedText(std::string(type))));
}

/// A whole number, which JSON may write as 8.0.
std::optional<size_t> ToSize(const Json& number) {
  if (number.is_number_unsigned()) return number.get<size_t>();
  const double value = number.is_number() ? number.get<double>() : -1;
  const bool is_whole = value >= 0 && value < 1e15 && value == std::floor(value);
  return is_whole ? std::optional(static_cast<size_t>(value)) : std::nullopt;
}

size_t SizeIn(const Json& object, const char* key, size_t otherwise) {
  const auto found = object.find(key);
  if (found == object.end()) return otherwise;
  const std::optional<size_t> size = ToSize(*found);
  if (!size) throw GltfFault(absl::StrCat("\"", key, "\" is no whole number"));
  return *size;
}

/// Elements of equal width in the bytes of a view.
struct Elements {
  std::string_view bytes;
  size_t count;
  size_t width;
  size_t stride;
};

/// Reads components of the type `Component`. Normalized ones are divided by `most`; the least
/// signed number is one further from zero than the greatest.
template <typename Component, typename Number>
void ReadAs(const Elements& elements, double most, std::vector<Number>& numbers) {
  for (size_t e = 0; e < elements.count; ++e) {
    const char* const at = elements.bytes.data() + e * elements.stride;
    for (size_t x = 0; x < elements.width; ++x) {
      Component component{};
      std::memcpy(&component, at + x * sizeof component, sizeof component);
      const auto value = static_cast<double>(component);
      numbers[e * elements.width + x] =
          static_cast<Number>(most > 0 ? std::max(value / most, -1.0) : value);
    }
  }
}

template <typename Number>
void ReadElements(const Elements& elements, int type, bool normalized,
                  std::vector<Number>& numbers) {
  const auto most = [&](double value) { return normalized ? value : 0; };
  if (type == 5120) ReadAs<int8_t>(elements, most(127), numbers);
  if (type == 5121) ReadAs<uint8_t>(elements, most(255), numbers);
  if (type == 5122) ReadAs<int16_t>(elements, most(32767), numbers);
  if (type == 5123) ReadAs<uint16_t>(elements, most(65535), numbers);
  if (type == 5125) ReadAs<uint32_t>(elements, most(4294967295), numbers);
  if (type == 5126) ReadAs<float>(elements, 0, numbers);
}

}  // namespace

absl::Status GltfRefusal(absl::string_view reason, const std::exception& fault) {
  const bool is_ours = dynamic_cast<const GltfFault*>(&fault) != nullptr;
  return Refusal(
      absl::StatusCode::kInvalidArgument, reason,
      absl::StrCat("the file cannot be read as glTF: ",
                   is_ours
                       ? std::string(fault.what())
                       : absl::StrCat(EscapedText(std::string_view(fault.what()).substr(0, 200)),
                                      ". Name its right format, or export it "
                                      "again")));
}

std::optional<std::string> BytesOfFile(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return file.is_open() && !file.bad() ? std::optional(std::move(bytes)) : std::nullopt;
}

GltfDocument::GltfDocument(std::string_view bytes, std::optional<std::string> folder)
    : folder_(std::move(folder)) {
  std::string_view text = bytes;
  if (bytes.starts_with("glTF")) {
    const Chunks chunks = Split(bytes);
    text = chunks.json;
    binary_ = chunks.binary;
  }
  constexpr int kMostDepth = 64;
  root_ =
      Json::parse(text, [](int depth, Json::parse_event_t, Json&) { return depth <= kMostDepth; });
  const std::string version = root_.at("asset").at("version").get<std::string>();
  if (!version.starts_with("2.")) {
    throw GltfFault(
        absl::StrCat("its version is ", QuotedText(version), ": export it as glTF 2.0"));
  }
}

void GltfDocument::CheckExtensions() const {
  for (const Json& name : root_.value("extensionsRequired", Json::array())) {
    const std::string extension = name.get<std::string>();
    if (std::ranges::any_of(kHarmless, [&](auto known) { return extension.starts_with(known); })) {
      continue;
    }
    throw GltfFault(absl::StrCat("it requires the extension ", QuotedText(extension),
                                 ", which is not read: ", WayOut(extension)));
  }
}

size_t GltfDocument::IndexIn(const char* array, const Json& index) const {
  const auto found = root_.find(array);
  const size_t count = found == root_.end() || !found->is_array() ? 0 : found->size();
  const std::optional<size_t> element = ToSize(index);
  if (element && *element < count) return *element;
  throw GltfFault(
      absl::StrCat("it names element ", QuotedText(index.dump()), " of its ", count, " ", array));
}

const Json& GltfDocument::At(const char* array, const Json& index) const {
  return root_.at(array)[IndexIn(array, index)];
}

std::string GltfDocument::FileOfBuffer(size_t index, const std::string& uri) const {
  if (!folder_) {
    throw GltfFault(absl::StrCat(
        "it keeps its data in another file, ", QuotedText(uri),
        ", which did not come with it: export the body as GLB, or name the .gltf file itself to "
        "Carillon's programs"));
  }
  const std::optional<std::string> path = FileOfGltfUri(*folder_, uri);
  if (!path) {
    throw GltfFault(absl::StrCat("buffer ", index,
                                 " names no file in the folder of the file: ", QuotedText(uri)));
  }
  if (std::optional<std::string> bytes = BytesOfFile(*path)) return *std::move(bytes);
  throw GltfFault(absl::StrCat("the file of its buffer ", index, ", ", QuotedText(uri),
                               ", cannot be read: put it beside the .gltf file"));
}

std::string_view GltfDocument::Buffer(size_t index) const {
  const Json& buffer = At("buffers", index);
  std::string_view bytes = index == 0 && !buffer.contains("uri") ? binary_ : std::string_view();
  if (buffer.contains("uri")) {
    const auto [known, is_new] = buffers_.try_emplace(index);
    const std::string uri = is_new ? buffer.at("uri").get<std::string>() : "";
    if (is_new && !absl::StartsWithIgnoreCase(uri, "data:")) {
      known->second = FileOfBuffer(index, uri);
    } else if (is_new) {
      const size_t base64 = uri.find(";base64,");
      if (base64 == std::string::npos ||
          !absl::Base64Unescape(absl::string_view(uri).substr(base64 + 8), &known->second)) {
        throw GltfFault("the data of a buffer is not in base64");
      }
    }
    bytes = known->second;
  }
  const size_t length = SizeIn(buffer, "byteLength", bytes.size());
  if (length <= bytes.size()) return bytes.substr(0, length);
  throw GltfFault(
      absl::StrCat("buffer ", index, " has ", bytes.size(), " of its ", length, " bytes"));
}

std::string_view GltfDocument::ViewBytes(const Json& view_index, size_t offset) const {
  const Json& view = At("bufferViews", view_index);
  const size_t buffer = IndexIn("buffers", view.at("buffer"));
  if (const Json extensions = view.value("extensions", Json::object()); !extensions.empty()) {
    for (const auto& [name, content] : extensions.items()) {
      // Without the extension the data may be in another buffer, unless that only gives a length.
      const Json& plain = At("buffers", buffer);
      if (plain.contains("uri") || (buffer == 0 && !binary_.empty())) continue;
      throw GltfFault(absl::StrCat("its data needs the extension ", QuotedText(name),
                                   ", which is not read: ", WayOut(name)));
    }
  }
  const std::string_view bytes = Buffer(buffer);
  const size_t begin = SizeIn(view, "byteOffset", 0), length = SizeIn(view, "byteLength", 0);
  if (begin <= bytes.size() && length <= bytes.size() - begin && offset <= length) {
    return bytes.substr(begin + offset, length - offset);
  }
  throw GltfFault(
      absl::StrCat("buffer view ", QuotedText(view_index.dump()), " reaches beyond its buffer"));
}

template <typename Number>
std::vector<Number> GltfDocument::Read(const Json& accessor_index, absl::string_view type) const {
  const Json& accessor = At("accessors", accessor_index);
  const std::string own_type = accessor.at("type").get<std::string>();
  if (own_type != type) {
    throw GltfFault(absl::StrCat("an accessor has the type ", QuotedText(own_type), " where ", type,
                                 " belongs"));
  }
  const int component = accessor.at("componentType").get<int>();
  const size_t count = SizeIn(accessor, "count", 0), width = WidthOf(type);
  const size_t size = SizeOfComponent(component) * width;
  std::vector<Number> numbers;
  if (accessor.contains("bufferView") && count > 0) {
    const Json& view = accessor.at("bufferView");
    const std::string_view bytes = ViewBytes(view, SizeIn(accessor, "byteOffset", 0));
    const size_t given_stride = SizeIn(At("bufferViews", view), "byteStride", 0);
    const size_t stride = given_stride > 0 ? given_stride : size;
    if (bytes.size() < size || stride < size || count - 1 > (bytes.size() - size) / stride) {
      throw GltfFault(absl::StrCat("accessor ", QuotedText(accessor_index.dump()),
                                   " reaches beyond its buffer view"));
    }
    numbers.resize(count * width);
    ReadElements({bytes, count, width, stride}, component, accessor.value("normalized", false),
                 numbers);
  } else {
    if (count > kMostZeros / width) throw GltfFault("an accessor has too many elements");
    numbers.resize(count * width);
  }
  if (accessor.contains("sparse")) {
    ApplySparse(accessor, width, numbers);
  } else if (!accessor.contains("bufferView")) {
    throw GltfFault(absl::StrCat("accessor ", QuotedText(accessor_index.dump()),
                                 " has no data of its own; data in an extension is not read: "
                                 "export the body again uncompressed"));
  }
  return numbers;
}

template std::vector<float> GltfDocument::Read(const Json&, absl::string_view) const;
template std::vector<double> GltfDocument::Read(const Json&, absl::string_view) const;

template <typename Number>
void GltfDocument::ApplySparse(const Json& accessor, size_t width,
                               std::vector<Number>& numbers) const {
  const Json& sparse = accessor.at("sparse");
  const Json& indices = sparse.at("indices");
  const Json& changes = sparse.at("values");
  const size_t count = SizeIn(sparse, "count", 0);
  const int index_type = indices.at("componentType").get<int>();
  const int type = accessor.at("componentType").get<int>();
  const size_t index_size = SizeOfComponent(index_type), size = SizeOfComponent(type) * width;
  const std::string_view at = ViewBytes(indices.at("bufferView"), SizeIn(indices, "byteOffset", 0));
  const std::string_view bytes =
      ViewBytes(changes.at("bufferView"), SizeIn(changes, "byteOffset", 0));
  if (count > at.size() / index_size || count > bytes.size() / size) {
    throw GltfFault("a sparse accessor reaches beyond its buffer view");
  }
  std::vector<double> elements(count);
  ReadElements({at, count, 1, index_size}, index_type, false, elements);
  std::vector<Number> values(count * width);
  ReadElements({bytes, count, width, size}, type, accessor.value("normalized", false), values);
  const size_t element_count = numbers.size() / width;
  for (size_t i = 0; i < count; ++i) {
    if (!(elements[i] >= 0 && elements[i] < static_cast<double>(element_count))) {
      throw GltfFault("a sparse accessor changes an element that it does not have");
    }
    std::copy_n(&values[i * width], width, &numbers[static_cast<size_t>(elements[i]) * width]);
  }
}

std::vector<uint32_t> GltfDocument::ReadIndices(const Json& accessor_index, size_t limit) const {
  const std::vector<double> numbers = Read<double>(accessor_index, "SCALAR");
  std::vector<uint32_t> indices(numbers.size());
  for (size_t i = 0; i < numbers.size(); ++i) {
    const double number = numbers[i];
    if (!(number >= 0 && number < static_cast<double>(limit)) || number != std::floor(number)) {
      throw GltfFault(absl::StrCat("a triangle names vertex ", number, " of ", limit,
                                   " (counted from zero): export the mesh again"));
    }
    indices[i] = static_cast<uint32_t>(number);
  }
  return indices;
}

}  // namespace carillon
