// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_document.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf_uri.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

constexpr char kMagic[] = "glTF";
constexpr uint32_t kJsonChunk = 0x4e4f534a;
constexpr uint32_t kBinaryChunk = 0x004e4942;
constexpr size_t kHeaderBytes = 12;
constexpr int kMostDepth = 64;
constexpr size_t kChunkHeaderBytes = 8;

uint32_t Word(std::string_view bytes, size_t at) {
  uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

void AppendWord(std::string& bytes, size_t word) {
  const auto narrow = static_cast<uint32_t>(word);
  bytes.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
}

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_regular_file(path, error)) {
    std::ifstream file(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (file.is_open() && !file.bad()) return bytes;
  }
  return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                 absl::StrCat(path, " cannot be read; check its name and its permissions"));
}

/// The chunks of a binary file.
struct Chunks {
  std::string_view json;
  std::optional<std::string_view> binary;
};

absl::StatusOr<Chunks> Split(std::string_view file) {
  if (file.size() < kHeaderBytes || Word(file, 4) != 2 || Word(file, 8) != file.size()) {
    return Malformed("the binary glTF file is not of version 2, or is cut short");
  }
  Chunks chunks;
  for (size_t at = kHeaderBytes; at < file.size();) {
    if (file.size() - at < kChunkHeaderBytes)
      return Malformed("a chunk of the glTF file is cut short");
    const uint32_t length = Word(file, at);
    const uint32_t type = Word(file, at + 4);
    at += kChunkHeaderBytes;
    if (file.size() - at < length) return Malformed("a chunk of the glTF file is cut short");
    if (type == kJsonChunk && chunks.json.empty()) chunks.json = file.substr(at, length);
    if (type == kBinaryChunk && !chunks.binary) chunks.binary = file.substr(at, length);
    at += length;
  }
  return chunks;
}

bool WriteWhole(const std::string& path, const std::vector<std::string_view>& pieces) {
  const std::string temporary = absl::StrCat(path, ".partial-", getpid());
  std::ofstream out(temporary, std::ios::binary);
  for (const std::string_view piece : pieces) {
    out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
  }
  out.close();
  if (out && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  unlink(temporary.c_str());
  return false;
}

}  // namespace

absl::StatusOr<GltfDocument> GltfDocument::Read(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string file, ReadFile(path));
  GltfDocument document;
  document.folder_ = std::filesystem::path(path).parent_path();
  std::string_view text = file;
  if (absl::StartsWith(file, kMagic)) {
    ASSIGN_OR_RETURN(const Chunks chunks, Split(file));
    text = chunks.json;
    if (chunks.binary) document.binary_ = std::string(*chunks.binary);
  }
  // Deeper values are left out, so that recursive functions do not exhaust the stack.
  const auto shallow = [](int depth, json::parse_event_t, json&) { return depth <= kMostDepth; };
  document.root_ = json::parse(text, shallow, false);
  if (document.root_.is_discarded()) return Malformed("the glTF file is no JSON, or is cut short");
  const std::string version = Text(Member(Member(document.root_, "asset"), "version"));
  if (!absl::StartsWith(version, "2.")) return Malformed("the file is no glTF of version 2");
  return document;
}

absl::StatusOr<std::string_view> GltfDocument::Buffer(uint64_t index) {
  auto known = buffers_.find(index);
  if (known == buffers_.end()) {
    ASSIGN_OR_RETURN(std::string bytes, ReadBuffer(index));
    known = buffers_.emplace(index, std::move(bytes)).first;
  }
  return std::string_view(known->second);
}

absl::StatusOr<std::string> GltfDocument::ReadBuffer(uint64_t index) const {
  const json& buffers = Member(root_, "buffers");
  if (!buffers.is_array() || index >= buffers.size()) {
    return Malformed(absl::StrCat("there is no buffer ", index));
  }
  const json& uri = Member(buffers[index], "uri");
  if (uri.is_null() && index == 0 && binary_) return *binary_;
  const std::string text = Text(uri);
  if (absl::StartsWith(text, "data:")) {
    const size_t comma = text.find(";base64,");
    std::string bytes;
    if (comma != std::string::npos && absl::Base64Unescape(text.substr(comma + 8), &bytes))
      return bytes;
    return Malformed(absl::StrCat("the data of buffer ", index, " are no base64"));
  }
  const std::optional<std::string> path = FileOfGltfUri(folder_, text);
  if (path) return ReadFile(*path);
  return Malformed(absl::StrCat("buffer ", index, " names no file in the folder of the glTF file"));
}

absl::Status WriteGltf(const std::string& path, json asset, std::string_view buffer, bool binary) {
  asset["buffers"] = json::array({{{"byteLength", buffer.size()}}});
  std::string head;
  if (binary) {
    std::string text = asset.dump(-1, ' ', false, json::error_handler_t::replace);
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::string padding((4 - buffer.size() % 4) % 4, '\0');
    const size_t total =
        kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + buffer.size() + padding.size();
    if (total > std::numeric_limits<uint32_t>::max()) return TooLarge("a binary glTF holds 4 GiB");
    head.append(kMagic, 4);
    for (const size_t word : {size_t{2}, total, text.size(), size_t{kJsonChunk}})
      AppendWord(head, word);
    head += text;
    AppendWord(head, buffer.size() + padding.size());
    AppendWord(head, kBinaryChunk);
    if (WriteWhole(path, {head, buffer, padding})) return absl::OkStatus();
  } else {
    const absl::string_view bytes(buffer.data(), buffer.size());
    asset["buffers"][0]["uri"] =
        absl::StrCat("data:application/octet-stream;base64,", absl::Base64Escape(bytes));
    const std::string text = asset.dump(1, ' ', false, json::error_handler_t::replace);
    if (WriteWhole(path, {text})) return absl::OkStatus();
  }
  return Refusal(
      absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
      absl::StrCat(path,
                   " cannot be written; check its folder, its permissions and the free space"));
}

const json& Member(const json& object, const char* key) {
  static const json nothing;
  if (!object.is_object()) return nothing;
  const auto found = object.find(key);
  return found == object.end() ? nothing : *found;
}

std::optional<uint64_t> Whole(const json& value) {
  if (value.is_number_unsigned()) return value.get<uint64_t>();
  return std::nullopt;
}

std::optional<double> Number(const json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

std::string Text(const json& value) { return value.is_string() ? value.get<std::string>() : ""; }

}  // namespace carillon::interchange
