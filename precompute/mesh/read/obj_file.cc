// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/surface_file.h"
#include "precompute/mesh/read/text/text_lines.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using ObjWords = std::span<const std::string_view>;

/// Statements of curved surfaces, which a polygon reader would lose, and statements that bring in
/// other files.
constexpr std::string_view kObjRefused[] = {"surf", "bzp", "bsp",  "cdc",
                                            "cdp",  "res", "call", "csh"};
/// Statements without bounding surface: what surfaces look like, points, lines, and curves.
constexpr std::string_view kObjIgnored[] = {
    "vt",     "vn",     "vp",    "p",    "l",        "s",        "mg",         "mtllib",
    "maplib", "usemap", "bevel", "lod",  "c_interp", "d_interp", "shadow_obj", "trace_obj",
    "cstype", "deg",    "bmat",  "step", "curv",     "curv2",    "parm",       "trim",
    "hole",   "scrv",   "sp",    "end",  "con",      "ctech",    "stech"};

class ObjParser {
 public:
  explicit ObjParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<SurfaceFile> Parse() && {
    std::string line;
    while (NextObjLine(lines_, line)) {
      const std::vector<std::string_view> words = TextLines::Words(WithoutComment(line));
      if (words.empty()) continue;
      RETURN_IF_ERROR(Take(words[0], ObjWords(words).subspan(1)));
    }
    if (file_.vertices.empty()) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                     "no line of the file is a vertex of an OBJ file (\"v x y z\"): name its "
                     "right format, or export it again");
    }
    RETURN_IF_ERROR(AddFaces());
    if (unknown_count_ > 0) {
      file_.warnings.push_back(absl::StrCat(unknown_count_,
                                            " lines of the file are no statements of OBJ and were "
                                            "left out, the first is line ",
                                            first_unknown_));
    }
    return std::move(file_);
  }

 private:
  /// A '#' begins a comment; one within a name does not.
  static std::string_view WithoutComment(std::string_view line) {
    for (size_t at = line.find('#'); at != std::string_view::npos; at = line.find('#', at + 1)) {
      if (at == 0 || line[at - 1] == ' ' || line[at - 1] == '\t') return line.substr(0, at);
    }
    return line;
  }

  /// The words of one line as they stand there: names of objects and materials may have blanks.
  static std::string_view WholeOf(ObjWords words) {
    if (words.empty()) return {};
    const std::string_view last = words.back();
    return {words[0].data(), static_cast<size_t>(last.data() + last.size() - words[0].data())};
  }

  absl::Status Take(std::string_view statement, ObjWords words) {
    if (statement == "v") return TakeVertex(words);
    if (statement == "f" || statement == "fo") return TakeFace(words);
    if (statement == "g") EnterGroups(in_groups_, words);
    if (statement == "g") return absl::OkStatus();
    if (statement == "o" || statement == "usemtl") {
      const std::string_view name = WholeOf(words);
      (statement == "o" ? object_ : material_) = name;
      file_.EnterRegion({object_, material_});
      if (statement == "o") EnterGroups(in_object_, ObjWords(&name, words.empty() ? 0 : 1));
      return absl::OkStatus();
    }
    if (std::ranges::find(kObjRefused, statement) != std::end(kObjRefused)) {
      return lines_.Unreadable(
          absl::StrCat("the statement ", QuotedText(statement),
                       " (a curved surface or another file) is not read; export polygons"));
    }
    if (std::ranges::find(kObjIgnored, statement) == std::end(kObjIgnored)) {
      if (unknown_count_++ == 0) first_unknown_ = lines_.number();
    }
    return absl::OkStatus();
  }

  /// "v x y z", with a weight, or with the three or four figures of a colour.
  absl::Status TakeVertex(ObjWords words) {
    if (words.size() < 3) return lines_.Unreadable("a vertex with fewer than three coordinates");
    if (words.size() == 5 || words.size() > 8) {
      return lines_.Unreadable(absl::StrCat("a vertex with ", words.size(), " numbers"));
    }
    ASSIGN_OR_RETURN(const Point p, TakePoint(lines_, words));
    if (words.size() == 4 && ToNumber<double>(words[3]) != 1.0) {
      return lines_.Unreadable(
          absl::StrCat("a vertex with the weight ", QuotedText(words[3]),
                       ", by which some programs divide and others do not; write it without"));
    }
    file_.vertices.push_back(p);
    return absl::OkStatus();
  }

  /// The words "7", "7/2", "7//3" of a face.
  absl::Status TakeFace(ObjWords words) {
    const auto before = static_cast<int64_t>(file_.vertices.size());
    for (const std::string_view word : words) {
      const std::optional<int64_t> index = ToNumber<int64_t>(word.substr(0, word.find('/')));
      if (!index) return lines_.Unreadable(absl::StrCat(QuotedText(word), " is no vertex"));
      // Vertices may follow the face; an index backward counts from those before it.
      if (*index == 0 || *index < -before) return OutOfRange(lines_.number(), *index);
      corners_.push_back(*index < 0 ? before + *index : *index - 1);
    }
    if (words.size() < 3) {  // points and lines bound nothing
      corners_.resize(corners_.size() - words.size());
      return absl::OkStatus();
    }
    faces_.push_back({lines_.number(), corners_.size(), file_.region});
    const auto end = static_cast<int32_t>(corners_.size() - 2 * faces_.size());
    for (auto t = static_cast<int32_t>(end + 2 - static_cast<int32_t>(words.size())); t < end;
         ++t) {
      for (const size_t g : in_groups_) AddToGroup(g, t);
      for (const size_t g : in_object_) AddToGroup(g, t);
    }
    return absl::OkStatus();
  }

  absl::Status AddFaces() {
    const auto count = static_cast<int64_t>(file_.vertices.size());
    std::vector<int32_t> polygon;
    size_t next = 0;
    for (const Face& face : faces_) {
      polygon.clear();
      for (; next < face.end; ++next) {
        if (corners_[next] >= count) return OutOfRange(face.line, corners_[next] + 1);
        polygon.push_back(static_cast<int32_t>(corners_[next]));
      }
      file_.region = face.region;
      file_.AddPolygon(polygon);
    }
    return absl::OkStatus();
  }

  absl::Status OutOfRange(int line, int64_t index) const {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
                   absl::StrCat("line ", line, ": a face names vertex ", index, " where there are ",
                                file_.vertices.size(), ": export the mesh again"));
  }

  /// "g one two": a face may be in several groups.
  void EnterGroups(std::vector<size_t>& entered, ObjWords names) {
    entered.clear();
    for (const std::string_view name : names) {
      const auto found = std::ranges::find(file_.groups, name, &MeshGroup::name);
      entered.push_back(static_cast<size_t>(found - file_.groups.begin()));
      if (found == file_.groups.end()) file_.groups.push_back({.name = std::string(name)});
    }
  }

  void AddToGroup(size_t group, int32_t triangle) {
    std::vector<int32_t>& triangles = file_.groups[group].triangles;
    if (triangles.empty() || triangles.back() != triangle) triangles.push_back(triangle);
  }

  struct Face {
    int line;
    size_t end;  // index after its last corner
    int32_t region;
  };

  TextLines lines_;
  SurfaceFile file_;
  std::vector<int64_t> corners_;
  std::vector<Face> faces_;
  std::vector<size_t> in_groups_, in_object_;
  std::string object_, material_;
  int unknown_count_ = 0;
  int first_unknown_ = 0;
};

}  // namespace

absl::StatusOr<SurfaceFile> ParseObj(const std::string& bytes) { return ObjParser(bytes).Parse(); }

}  // namespace carillon::precompute
