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
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
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

/// Returns the path of the file with that suffix beside `path`, also if its name is in capitals.
std::filesystem::path Beside(std::filesystem::path path, const char* suffix) {
  path.replace_extension(suffix);
  if (std::filesystem::exists(path)) return path;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator(
           path.has_parent_path() ? path.parent_path() : ".", unreadable)) {
    const std::filesystem::path& other = entry.path();
    if (absl::EqualsIgnoreCase(other.filename().string(), path.filename().string())) return other;
  }
  return path;
}

absl::StatusOr<std::string> ReadTetgen(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string nodes, ReadOne(Beside(path, ".node")));
  const std::filesystem::path elements = Beside(path, ".ele");
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

bool ReadDocument(absl::string_view gltf, Struct& document) {
  absl::ConsumePrefix(&gltf, "\xEF\xBB\xBF");  // a byte order mark
  return google::protobuf::util::JsonStringToMessage({gltf.data(), gltf.size()}, &document).ok();
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

/// The file of which a line of Abaqus' input has the content, and what else the line says.
struct InpInput {
  std::string file;
  std::string line;
};

/// Reads "*INCLUDE, INPUT=FILE" and "*NODE, INPUT=FILE, ...". Returns nothing for other lines.
std::optional<InpInput> InputOf(absl::string_view line) {
  line = absl::StripAsciiWhitespace(line);
  if (!absl::ConsumePrefix(&line, "*") || absl::StartsWith(line, "*")) return std::nullopt;
  std::vector<absl::string_view> fields = absl::StrSplit(line, ',');
  const absl::string_view keyword = absl::StripAsciiWhitespace(fields[0]);
  const auto is_keyword = [&](const char* name) { return absl::EqualsIgnoreCase(keyword, name); };
  const bool is_include = is_keyword("INCLUDE");
  if (!is_include && !is_keyword("NODE") && !is_keyword("ELEMENT") && !is_keyword("NSET") &&
      !is_keyword("ELSET")) {
    return std::nullopt;
  }
  for (auto field = fields.begin() + 1; field != fields.end(); ++field) {
    const std::vector<absl::string_view> sides = absl::StrSplit(*field, absl::MaxSplits('=', 1));
    if (sides.size() < 2) continue;
    if (!absl::EqualsIgnoreCase(absl::StripAsciiWhitespace(sides[0]), "INPUT")) continue;
    absl::string_view name = absl::StripAsciiWhitespace(sides[1]);
    if (name.size() > 1 && absl::StartsWith(name, "\"") && absl::EndsWith(name, "\"")) {
      name = name.substr(1, name.size() - 2);
    }
    fields.erase(field);
    const std::string rest = absl::StrCat("*", absl::StrJoin(fields, ","), "\n");
    return InpInput{absl::StrReplaceAll(name, {{"\\", "/"}}), is_include ? "" : rest};
  }
  return std::nullopt;
}

std::string Quoted(const std::string& text) {
  return absl::StrCat("\"", absl::CHexEscape(text), "\"");
}

/// Adds the lines of `bytes`, a file that `deck` includes or `deck` itself, and those of the files
/// that it includes, whose names count from the folder of `deck`. A comment "**@ LINE FILE" says
/// from where the next line is.
absl::Status AddInp(const std::filesystem::path& deck, const std::string& name, int depth,
                    const std::string& bytes, std::string& joined) {
  constexpr int kMostDepth = 16;
  int number = 0;
  for (const absl::string_view line : absl::StrSplit(bytes, '\n')) {
    ++number;
    const std::optional<InpInput> input = InputOf(line);
    if (!input) {
      absl::StrAppend(&joined, line, "\n");
      continue;
    }
    const std::filesystem::path path(input->file);
    const bool is_outside =
        path.is_absolute() || std::ranges::find(path, std::filesystem::path("..")) != path.end();
    if (is_outside || depth == kMostDepth) {
      return Refusal(
          absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
          absl::StrCat("line ", number, " of ", name.empty() ? deck.string() : Quoted(name),
                       " includes ", Quoted(input->file),
                       is_outside ? ", which is not in the folder of the file: put it "
                                    "there, and name it without its folder"
                                  : ": the files include each other without an end"));
    }
    ASSIGN_OR_RETURN(const std::string content, ReadOne(deck.parent_path() / path));
    absl::StrAppend(&joined, input->line, "**@ 1 ", input->file, "\n");
    RETURN_IF_ERROR(AddInp(deck, input->file, depth + 1, content, joined));
    absl::StrAppend(&joined, "**@ ", number + 1, " ", name, "\n");
    if (joined.size() > kMostMeshBytes) return TooLarge(deck);
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadInp(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(std::string bytes, ReadOne(path));
  bool includes = false;
  for (const absl::string_view line : absl::StrSplit(bytes, '\n')) {
    includes = InputOf(line).has_value();
    if (includes) break;
  }
  if (!includes) return bytes;
  std::string joined;
  RETURN_IF_ERROR(AddInp(path, "", 0, bytes, joined));
  return joined;
}

absl::StatusOr<std::string> ReadAnyFormat(const std::filesystem::path& path,
                                          const std::string& format) {
  const std::string suffix = absl::AsciiStrToLower(path.extension().string());
  if (format == "node" && (suffix == ".node" || suffix == ".ele")) return ReadTetgen(path);
  if (format == "inp") return ReadInp(path);
  const bool has_buffers = format == "gltf" && suffix == ".gltf";
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
