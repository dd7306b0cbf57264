// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/clean_surface_file.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/read/text_lines.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr size_t kBinaryStlHeader = 84;  // bytes, before the first triangle

using Words = std::span<const std::string_view>;

absl::string_view ToAbsl(std::string_view text) { return {text.data(), text.size()}; }

absl::Status NoFaces() {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_EMPTY",
                 "the file has no faces: export the body as triangles or polygons");
}

absl::Status OutOfRange(int line, int64_t index, size_t count) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
                 absl::StrCat("line ", line, ": a face names vertex ", index, " where there are ",
                              count, ": export the mesh again"));
}

/// Appends the first three of `words` to `out` if they are a point.
absl::Status AppendPoint(const TextLines& lines, Words words, std::string& out) {
  if (words.size() < 3) return lines.Unreadable("a vertex with fewer than three coordinates");
  for (const std::string_view word : words.first(3)) {
    const std::optional<double> x = ToNumber<double>(word);
    if (!x) return lines.Unreadable(absl::StrCat("\"", ToAbsl(word), "\" is no coordinate"));
    if (!std::isfinite(*x)) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_NOT_FINITE",
                     absl::StrCat("line ", lines.number(), ": a vertex has the coordinate ",
                                  ToAbsl(word), ": give it finite coordinates"));
    }
    // The vertex is written again, because assimp ignores a vertex with a number like ".5".
    absl::StrAppendFormat(&out, " %.17g", *x);
  }
  out += '\n';
  return absl::OkStatus();
}

/// A face of an OBJ file before all vertices are known.
struct ObjFace {
  int line;
  size_t vertices_before;
  std::vector<int64_t> indices;  // from 1, or from -1 backward
};

/// Reads the words "7", "7/2", "7//3" of a face.
absl::StatusOr<ObjFace> ReadObjFace(const TextLines& lines, Words words, size_t vertices_before) {
  ObjFace face{lines.number(), vertices_before, {}};
  for (const std::string_view word : words) {
    const std::optional<int64_t> index = ToNumber<int64_t>(word.substr(0, word.find('/')));
    if (!index) return lines.Unreadable(absl::StrCat("\"", ToAbsl(word), "\" is no vertex"));
    face.indices.push_back(*index);
  }
  return face;
}

absl::Status AppendObjFace(const ObjFace& face, size_t vertex_count, std::string& out) {
  out += 'f';
  for (const int64_t index : face.indices) {
    const auto before = static_cast<int64_t>(face.vertices_before);
    const int64_t absolute = index < 0 ? before + 1 + index : index;
    if (absolute < 1 || absolute > static_cast<int64_t>(vertex_count)) {
      return OutOfRange(face.line, index, vertex_count);
    }
    absl::StrAppend(&out, " ", absolute);
  }
  out += '\n';
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> CleanObj(const std::string& bytes) {
  std::string clean, line;
  std::vector<ObjFace> faces;
  size_t vertex_count = 0;
  for (TextLines lines(bytes); NextObjLine(lines, line);) {
    const std::vector<std::string_view> words =
        TextLines::Words(std::string_view(line).substr(0, line.find('#')));
    if (words.empty()) continue;
    const Words arguments = Words(words).subspan(1);
    if (words[0] == "v") {
      clean += 'v';
      RETURN_IF_ERROR(AppendPoint(lines, arguments, clean));
      ++vertex_count;
    } else if (words[0] == "f") {
      ASSIGN_OR_RETURN(ObjFace face, ReadObjFace(lines, arguments, vertex_count));
      // Points and lines bound nothing.
      if (face.indices.size() >= 3) faces.push_back(std::move(face));
    }
  }
  if (vertex_count == 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   "no line of the file is a vertex of an OBJ file (\"v x y z\"): name its right "
                   "format, or export it again");
  }
  if (faces.empty()) return NoFaces();
  for (const ObjFace& face : faces) {
    RETURN_IF_ERROR(AppendObjFace(face, vertex_count, clean));
  }
  return clean;
}

absl::StatusOr<std::string> CleanOff(const std::string& bytes) {
  TextLines lines(bytes);
  std::vector<std::string_view> words = lines.NextWords();
  if (words.empty() || !words[0].ends_with("OFF") || words[0].starts_with("4") ||
      words[0].starts_with("n")) {
    return lines.Unreadable("an OFF file begins with \"OFF\"");
  }
  words.erase(words.begin());
  if (words.empty()) words = lines.NextWords();
  const std::optional<size_t> vertex_count =
      words.empty() ? std::nullopt : ToNumber<size_t>(words[0]);
  const std::optional<size_t> face_count =
      words.size() < 2 ? std::nullopt : ToNumber<size_t>(words[1]);
  if (!vertex_count || !face_count) return lines.Unreadable("no numbers of vertices and faces");
  if (*face_count == 0) return NoFaces();
  std::string clean = absl::StrCat("OFF\n", *vertex_count, " ", *face_count, " 0\n");
  for (size_t v = 0; v < *vertex_count; ++v) {
    words = lines.NextWords();
    if (words.empty()) return lines.Unreadable(absl::StrCat("the file ends at vertex ", v));
    RETURN_IF_ERROR(AppendPoint(lines, words, clean));
  }
  for (size_t f = 0; f < *face_count; ++f) {
    words = lines.NextWords();
    if (words.empty()) return lines.Unreadable(absl::StrCat("the file ends at face ", f));
    const std::optional<size_t> corner_count = ToNumber<size_t>(words[0]);
    if (!corner_count || *corner_count >= words.size()) {
      return lines.Unreadable("a face with fewer corners than it says");
    }
    absl::StrAppend(&clean, *corner_count);
    for (const std::string_view word : Words(words).subspan(1, *corner_count)) {
      const std::optional<int64_t> index = ToNumber<int64_t>(word);
      if (!index) return lines.Unreadable(absl::StrCat("\"", ToAbsl(word), "\" is no vertex"));
      if (*index < 0 || *index >= static_cast<int64_t>(*vertex_count)) {
        return OutOfRange(lines.number(), *index, *vertex_count);
      }
      absl::StrAppend(&clean, " ", *index);
    }
    clean += '\n';
  }
  return clean;
}

absl::StatusOr<std::string> CleanSurfaceFile(const std::string& bytes, const std::string& format) {
  if (format == "obj") return CleanObj(bytes);
  if (format == "off") return CleanOff(bytes);
  if (format == "ply") {
    RETURN_IF_ERROR(CheckPly(bytes));
  }
  if (format == "glb") {
    RETURN_IF_ERROR(CheckGlb(bytes));
  }
  if (format == "stl" && bytes.size() == kBinaryStlHeader) return NoFaces();
  return bytes;
}

}  // namespace carillon::precompute
