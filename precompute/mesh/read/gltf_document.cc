// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/gltf_document.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::json;

/// Numbers of one accessor; a file of 256 MiB has no more.
constexpr size_t kMostGltfValues = 100'000'000;

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

size_t SizeOfComponent(int type) {
  if (type == 5120 || type == 5121) return 1;
  if (type == 5122 || type == 5123) return 2;
  if (type == 5125 || type == 5126) return 4;
  FailGltf(absl::StrCat("an accessor has the component type ", type));
}

template <typename T>
double NumberOf(const char* bytes, double most) {
  T number{};
  std::memcpy(&number, bytes, sizeof number);
  // The least signed number is one further from zero than the greatest.
  return most > 0 ? std::max(static_cast<double>(number) / most, -1.0)
                  : static_cast<double>(number);
}

double Component(const char* bytes, int type, bool normalized) {
  const auto most = [&](double value) { return normalized ? value : 0; };
  if (type == 5120) return NumberOf<int8_t>(bytes, most(127));
  if (type == 5121) return NumberOf<uint8_t>(bytes, most(255));
  if (type == 5122) return NumberOf<int16_t>(bytes, most(32767));
  if (type == 5123) return NumberOf<uint16_t>(bytes, most(65535));
  if (type == 5125) return NumberOf<uint32_t>(bytes, most(4294967295));
  return NumberOf<float>(bytes, 0);
}

size_t WidthOf(absl::string_view type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  if (type == "MAT4") return 16;
  FailGltf(absl::StrCat("an accessor has the type ", QuotedText(std::string(type))));
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
  if (!size) FailGltf(absl::StrCat("\"", key, "\" is no whole number"));
  return *size;
}

std::string DecodeUri(const std::string& uri) {
  if (!absl::StartsWithIgnoreCase(uri, "data:")) {
    FailGltf(absl::StrCat("it keeps its data in another file, ", QuotedText(uri),
                          ", which did not come with it: export the body as GLB, or name the .gltf "
                          "file itself to Carillon's programs"));
  }
  const size_t comma = uri.find(',');
  std::string bytes;
  if (comma == std::string_view::npos ||
      !absl::EndsWith(absl::string_view(uri).substr(0, comma), ";base64") ||
      !absl::Base64Unescape(absl::string_view(uri).substr(comma + 1), &bytes)) {
    FailGltf("the data of a buffer is not in base64");
  }
  return bytes;
}

}  // namespace

void FailGltf(absl::string_view what, absl::string_view reason) {
  throw GltfFault(Refusal(absl::StatusCode::kInvalidArgument, reason,
                          absl::StrCat("the file cannot be read as glTF: ", what)));
}

GltfDocument::GltfDocument(std::string_view text, std::string_view binary)
    : root_(Json::parse(text)), binary_(binary) {
  const std::string version = root_.at("asset").at("version").get<std::string>();
  if (!version.starts_with("2.")) {
    FailGltf(absl::StrCat("its version is ", QuotedText(version), ": export it as glTF 2.0"));
  }
  for (const Json& name : root_.value("extensionsRequired", Json::array())) {
    const std::string extension = name.get<std::string>();
    if (std::ranges::any_of(kHarmless, [&](auto known) { return extension.starts_with(known); })) {
      continue;
    }
    FailGltf(absl::StrCat("it requires the extension ", QuotedText(extension),
                          ", which is not read: ", WayOut(extension)));
  }
  for (const Json& buffer : root_.value("buffers", Json::array())) {
    decoded_.push_back(buffer.contains("uri") ? DecodeUri(buffer.at("uri").get<std::string>())
                                              : "");
  }
}

const Json& GltfDocument::At(const char* array, const Json& index) const {
  const auto found = root_.find(array);
  const size_t count = found == root_.end() ? 0 : found->size();
  const std::optional<size_t> element = ToSize(index);
  if (!element || *element >= count) {
    FailGltf(
        absl::StrCat("it names element ", QuotedText(index.dump()), " of its ", count, " ", array),
        "MESH_INDEX_OUT_OF_RANGE");
  }
  return (*found)[*element];
}

std::string_view GltfDocument::BufferBytes(size_t index) const {
  const Json& buffer = At("buffers", index);
  const bool in_chunk = !buffer.contains("uri") && index == 0 && !binary_.empty();
  const std::string_view bytes = in_chunk ? binary_ : std::string_view(decoded_[index]);
  const size_t length = SizeIn(buffer, "byteLength", 0);
  if (length > bytes.size()) {
    FailGltf(absl::StrCat("buffer ", index, " has ", bytes.size(), " of its ", length, " bytes"));
  }
  return bytes.substr(0, length);
}

std::string_view GltfDocument::ViewBytes(const Json& view_index, size_t offset) const {
  const Json& view = At("bufferViews", view_index);
  const size_t buffer = SizeIn(view, "buffer", 0);
  if (const Json extensions = view.value("extensions", Json::object()); !extensions.empty()) {
    for (const auto& [name, content] : extensions.items()) {
      // Without the extension the data may be in another buffer, unless that only gives a length.
      const Json& plain = At("buffers", buffer);
      if (plain.contains("uri") || (buffer == 0 && !binary_.empty())) continue;
      FailGltf(absl::StrCat("its data needs the extension ", QuotedText(name),
                            ", which is not read: ", WayOut(name)));
    }
  }
  const std::string_view bytes = BufferBytes(buffer);
  const size_t begin = SizeIn(view, "byteOffset", 0), length = SizeIn(view, "byteLength", 0);
  if (begin > bytes.size() || length > bytes.size() - begin || offset > length) {
    FailGltf(
        absl::StrCat("buffer view ", QuotedText(view_index.dump()), " reaches beyond its buffer"));
  }
  return bytes.substr(begin + offset, length - offset);
}

GltfValues GltfDocument::Read(const Json& accessor_index, absl::string_view type) const {
  const Json& accessor = At("accessors", accessor_index);
  const std::string own_type = accessor.at("type").get<std::string>();
  if (own_type != type) {
    FailGltf(absl::StrCat("an accessor has the type ", QuotedText(own_type), " where ", type,
                          " belongs"));
  }
  const int component = accessor.at("componentType").get<int>();
  const bool normalized = accessor.value("normalized", false);
  const size_t count = SizeIn(accessor, "count", 0), size = SizeOfComponent(component);
  GltfValues result{.width = WidthOf(type), .values = {}};
  if (count > kMostGltfValues / result.width) FailGltf("an accessor has too many elements");
  result.values.resize(count * result.width);
  if (accessor.contains("bufferView") && count > 0) {
    const Json& view_index = accessor.at("bufferView");
    const std::string_view bytes = ViewBytes(view_index, SizeIn(accessor, "byteOffset", 0));
    const size_t stride = SizeIn(At("bufferViews", view_index), "byteStride", size * result.width);
    if (bytes.size() < size * result.width ||
        (stride > 0 && (count - 1) > (bytes.size() - size * result.width) / stride)) {
      FailGltf(absl::StrCat("accessor ", QuotedText(accessor_index.dump()),
                            " reaches beyond its buffer view"));
    }
    for (size_t i = 0; i < result.values.size(); ++i) {
      const char* at = bytes.data() + i / result.width * stride + i % result.width * size;
      result.values[i] = Component(at, component, normalized);
    }
  }
  if (accessor.contains("sparse")) {
    ApplySparse(accessor.at("sparse"), {component, normalized}, result);
  } else if (!accessor.contains("bufferView")) {
    FailGltf(absl::StrCat("accessor ", QuotedText(accessor_index.dump()),
                          " has no data of its own; data in an extension is not read: export the "
                          "body again uncompressed"));
  }
  return result;
}

void GltfDocument::ApplySparse(const Json& sparse, const Kind& kind, GltfValues& values) const {
  const size_t count = SizeIn(sparse, "count", 0);
  const Json& indices = sparse.at("indices");
  const Json& changes = sparse.at("values");
  const int index_type = indices.at("componentType").get<int>();
  const size_t index_size = SizeOfComponent(index_type), size = SizeOfComponent(kind.component);
  const std::string_view at = ViewBytes(indices.at("bufferView"), SizeIn(indices, "byteOffset", 0));
  const std::string_view bytes =
      ViewBytes(changes.at("bufferView"), SizeIn(changes, "byteOffset", 0));
  if (count > at.size() / index_size || count > bytes.size() / (size * values.width)) {
    FailGltf("a sparse accessor reaches beyond its buffer view");
  }
  for (size_t i = 0; i < count; ++i) {
    const auto element = static_cast<size_t>(Component(&at[i * index_size], index_type, false));
    if (element >= values.count()) {
      FailGltf("a sparse accessor changes an element that it does not have",
               "MESH_INDEX_OUT_OF_RANGE");
    }
    for (size_t x = 0; x < values.width; ++x) {
      values.values[element * values.width + x] =
          Component(&bytes[(i * values.width + x) * size], kind.component, kind.normalized);
    }
  }
}

}  // namespace carillon::precompute
