// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/mesh_file.h"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/gltf_uri.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

constexpr size_t kMostMeshBytes = size_t{256} << 20;
constexpr size_t kReadPiece = size_t{1} << 20;

absl::Status TooLarge(const std::filesystem::path& path) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
      absl::StrCat(path.string(), " has more than 256 MiB: simplify the body's surface"));
}

/// Reads at most `limit` bytes. The file may be a pipe or a device, which knows no length.
std::string ReadUpTo(std::ifstream& file, size_t limit) {
  std::string bytes;
  while (file && bytes.size() < limit) {
    const size_t read = bytes.size();
    bytes.resize(std::min(limit, read + kReadPiece));
    file.read(bytes.data() + read, static_cast<std::streamsize>(bytes.size() - read));
    bytes.resize(read + static_cast<size_t>(file.gcount()));
  }
  return bytes;
}

absl::StatusOr<std::string> ReadOne(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  const bool opened = file.is_open();
  std::string bytes = ReadUpTo(file, kMostMeshBytes + 1);
  if (!opened || file.bad()) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path.string(), " cannot be read (", std::strerror(errno),
                                "): check that it is a file, its name and its permissions"));
  }
  if (bytes.size() > kMostMeshBytes) return TooLarge(path);
  return bytes;
}

absl::StatusOr<std::string> ReadTetgen(std::filesystem::path path) {
  ASSIGN_OR_RETURN(const std::string nodes, ReadOne(path.replace_extension(".node")));
  const std::filesystem::path elements = path.replace_extension(".ele");
  // One file may contain both already.
  if (!std::filesystem::exists(elements)) return nodes;
  ASSIGN_OR_RETURN(const std::string rest, ReadOne(elements));
  return absl::StrCat(nodes, nodes.ends_with('\n') ? "" : "\n", rest);
}

bool IsExternal(const std::string& uri) { return !absl::StartsWithIgnoreCase(uri, "data:"); }

/// Adds the address of the buffer's file, if the buffer has a file.
void AddUri(Value& buffer, std::vector<std::string*>& uris) {
  if (!buffer.has_struct_value()) return;
  auto& fields = *buffer.mutable_struct_value()->mutable_fields();
  const auto uri = fields.find("uri");
  if (uri == fields.end() || !uri->second.has_string_value()) return;
  if (IsExternal(uri->second.string_value())) uris.push_back(uri->second.mutable_string_value());
}

/// Returns the addresses of all files with buffers.
std::vector<std::string*> ExternalUris(Struct& document) {
  std::vector<std::string*> uris;
  const auto buffers = document.mutable_fields()->find("buffers");
  if (buffers == document.mutable_fields()->end() || !buffers->second.has_list_value()) return uris;
  for (Value& buffer : *buffers->second.mutable_list_value()->mutable_values()) {
    AddUri(buffer, uris);
  }
  return uris;
}

bool ReadDocument(const std::string& gltf, Struct& document) {
  return google::protobuf::util::JsonStringToMessage(gltf, &document).ok();
}

absl::StatusOr<std::string> ReadBuffer(const std::filesystem::path& document,
                                       const std::string& uri) {
  const std::optional<std::string> file = FileOfGltfUri(document.parent_path(), uri);
  if (file) return ReadOne(*file);
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                 absl::StrCat(document.string(), " keeps its data in \"", absl::CHexEscape(uri),
                              "\", which is not in its folder: put it there, or export the body "
                              "as GLB"));
}

absl::StatusOr<std::string> ReadGltf(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(std::string bytes, ReadOne(path));
  Struct document;
  if (!ReadDocument(bytes, document)) return bytes;
  const std::vector<std::string*> uris = ExternalUris(document);
  if (uris.empty()) return bytes;
  size_t byte_count = 0;
  for (std::string* uri : uris) {
    ASSIGN_OR_RETURN(const std::string data, ReadBuffer(path, *uri));
    byte_count += data.size();
    if (byte_count > kMostMeshBytes) return TooLarge(path);
    *uri = absl::StrCat("data:application/octet-stream;base64,", absl::Base64Escape(data));
  }
  bytes.clear();
  if (!google::protobuf::util::MessageToJsonString(document, &bytes).ok()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   absl::StrCat(path.string(),
                                " cannot be joined with its data: export the body "
                                "as GLB"));
  }
  if (bytes.size() > kMostMeshBytes) return TooLarge(path);
  return bytes;
}

absl::StatusOr<std::string> ReadAnyFormat(const std::filesystem::path& path,
                                          const std::string& format) {
  const std::filesystem::path suffix = path.extension();
  if (format == "node" && (suffix == ".node" || suffix == ".ele")) return ReadTetgen(path);
  const bool has_buffers = format == "gltf" && absl::EqualsIgnoreCase(suffix.string(), ".gltf");
  return has_buffers ? ReadGltf(path) : ReadOne(path);
}

}  // namespace

std::string MeshFormatOf(const std::string& path) {
  const std::string suffix = std::filesystem::path(path).extension();
  const std::string format = absl::AsciiStrToLower(absl::StripPrefix(suffix, "."));
  return format == "ele" ? "node" : format;
}

absl::StatusOr<std::string> ReadMeshFile(const std::string& path, const std::string& format) {
  ASSIGN_OR_RETURN(std::string bytes, ReadAnyFormat(path, format));
  if (!bytes.empty()) return bytes;
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                 "the mesh file has no bytes: export the body again");
}

}  // namespace carillon
