// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
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

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::optional<PlyType> count_type;  // of a list
  PlyType type;
  std::string_view name;
};

struct PlyElement {
  std::string_view name;
  size_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::string_view format;
  std::vector<PlyElement> elements;
};

std::optional<PlyType> ToPlyType(std::string_view name) {
  using enum PlyType;
  static const std::map<std::string_view, PlyType> types = {
      {"char", kInt8},   {"int8", kInt8},     {"uchar", kUint8},   {"uint8", kUint8},
      {"short", kInt16}, {"int16", kInt16},   {"ushort", kUint16}, {"uint16", kUint16},
      {"int", kInt32},   {"int32", kInt32},   {"uint", kUint32},   {"uint32", kUint32},
      {"float", kFloat}, {"float32", kFloat}, {"double", kDouble}, {"float64", kDouble}};
  const auto found = types.find(name);
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// One line of the header: "element vertex 8", "property list uchar int vertex_indices".
bool ReadPlyHeaderLine(const std::vector<std::string_view>& words, PlyHeader& header) {
  if (words[0] == "format" && words.size() >= 2) {
    header.format = words[1];
  } else if (words[0] == "element" && words.size() == 3) {
    const auto count = ToNumber<size_t>(words[2]);
    if (!count) return false;
    header.elements.push_back({words[1], *count, {}});
  } else if (words[0] == "property" && !header.elements.empty()) {
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (!is_list && words.size() != 3) return false;
    const std::optional<PlyType> type = ToPlyType(words[is_list ? 3 : 1]);
    const std::optional<PlyType> count_type = is_list ? ToPlyType(words[2]) : std::nullopt;
    if (!type || (is_list && !count_type)) return false;
    header.elements.back().properties.push_back({count_type, *type, words.back()});
  } else {
    // Old exporters of Blender write their name before the elements without "comment".
    return words[0] == "comment" || words[0] == "obj_info" || header.elements.empty();
  }
  return true;
}

absl::StatusOr<PlyHeader> ReadPlyHeader(TextLines& lines) {
  std::string_view line;
  const bool has_line = lines.Next(line);
  const std::vector<std::string_view> first = TextLines::Words(line);
  if (!has_line || first.size() != 1 || (first[0] != "ply" && first[0] != "PLY")) {
    return lines.Unreadable("a PLY file begins with \"ply\"");
  }
  PlyHeader header;
  while (lines.Next(line)) {
    const std::vector<std::string_view> words = TextLines::Words(line);
    if (words.empty()) continue;
    if (words[0] == "end_header") return header;
    if (!ReadPlyHeaderLine(words, header)) return lines.Unreadable("no line of a PLY header");
  }
  return lines.Unreadable("the file ends within its header");
}

/// The numbers of a text, whose rows are lines.
class PlyText {
 public:
  explicit PlyText(TextLines& lines) : lines_(lines) {}

  bool BeginRow() {
    words_ = std::vector<std::string_view>();
    std::string_view line;
    while (words_.empty() && lines_.Next(line)) words_ = TextLines::Words(line);
    next_ = 0;
    return !words_.empty();
  }

  absl::Status Take(PlyType /*type*/, double& value) {
    if (next_ == words_.size()) return lines_.Unreadable("fewer figures than the header says");
    const std::optional<double> number = ToNumber<double>(words_[next_]);
    if (!number) return lines_.Unreadable(absl::StrCat(QuotedText(words_[next_]), " is no number"));
    value = *number;
    ++next_;
    return absl::OkStatus();
  }

  absl::Status EndRow() const {
    if (next_ == words_.size()) return absl::OkStatus();
    return lines_.Unreadable("more figures than the header says");
  }

  bool AtEnd() { return !BeginRow(); }

 private:
  TextLines& lines_;
  std::vector<std::string_view> words_;
  size_t next_ = 0;
};

/// The numbers of a binary file.
class PlyBytes {
 public:
  PlyBytes(const TextLines& lines, bool swapped) : rest_(lines.rest()), swapped_(swapped) {}

  bool BeginRow() const { return !rest_.empty(); }

  absl::Status Take(PlyType type, double& value) {
    using enum PlyType;
    switch (type) {
      case kInt8:
        return TakeAs<int8_t>(value);
      case kUint8:
        return TakeAs<uint8_t>(value);
      case kInt16:
        return TakeAs<int16_t>(value);
      case kUint16:
        return TakeAs<uint16_t>(value);
      case kInt32:
        return TakeAs<int32_t>(value);
      case kUint32:
        return TakeAs<uint32_t>(value);
      case kFloat:
        return TakeAs<float>(value);
      case kDouble:
        return TakeAs<double>(value);
    }
    return absl::OkStatus();
  }

  static absl::Status EndRow() { return absl::OkStatus(); }

  /// Some programs end the file by a line end or zero bytes.
  bool AtEnd() const {
    return rest_.find_first_not_of(std::string_view(" \t\r\n\0", 5)) == std::string_view::npos;
  }

 private:
  template <typename T>
  absl::Status TakeAs(double& value) {
    if (rest_.size() < sizeof(T)) return absl::OutOfRangeError("");
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), rest_.data(), sizeof(T));
    if (swapped_) std::ranges::reverse(bytes);
    value = static_cast<double>(std::bit_cast<T>(bytes));
    rest_.remove_prefix(sizeof(T));
    return absl::OkStatus();
  }

  std::string_view rest_;
  bool swapped_;
};

/// Values of one row: what counts of a vertex, a face or strips.
struct PlyRow {
  Point place{};
  std::vector<double> list;
};

class PlyParser {
 public:
  explicit PlyParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<SurfaceFile> Parse() && {
    ASSIGN_OR_RETURN(header_, ReadPlyHeader(lines_));
    RETURN_IF_ERROR(CheckHeader());
    if (header_.format == "ascii") {
      PlyText text(lines_);
      RETURN_IF_ERROR(ReadElements(text));
      return std::move(file_);
    }
    if (header_.format != "binary_little_endian" && header_.format != "binary_big_endian") {
      return lines_.Unreadable(
          "its format is neither ascii nor binary_little_endian nor binary_big_endian");
    }
    PlyBytes bytes(lines_, header_.format == "binary_big_endian");
    RETURN_IF_ERROR(ReadElements(bytes));
    return std::move(file_);
  }

 private:
  static bool IsCoordinate(std::string_view name) {
    return name == "x" || name == "y" || name == "z";
  }

  static bool IsCorners(const PlyProperty& property) {
    return property.count_type &&
           (property.name == "vertex_indices" || property.name == "vertex_index");
  }

  absl::Status CheckHeader() {
    bool has_faces = false;
    size_t coordinate_count = 0;
    for (const PlyElement& element : header_.elements) {
      if (element.name == "range_grid") {
        return lines_.Unreadable(
            "its surface is a grid of ranges (\"element range_grid\"), which is not read: export "
            "faces");
      }
      const bool known = element.name == "vertex" || element.name == "face" ||
                         element.name == "tristrips" || element.name == "edge";
      if (!known && element.count > 0) {
        file_.warnings.push_back(
            absl::StrCat("the elements ", QuotedText(element.name), " of the file were left out"));
      }
      for (const PlyProperty& property : element.properties) {
        coordinate_count +=
            element.name == "vertex" && !property.count_type && IsCoordinate(property.name);
        has_faces |= (element.name == "face" || element.name == "tristrips") && IsCorners(property);
      }
    }
    if (coordinate_count == 3 && has_faces) return absl::OkStatus();
    return lines_.Unreadable(
        "the header names no vertices with x, y, z or no faces with vertex_indices");
  }

  template <typename Source>
  absl::Status ReadElements(Source& source) {
    for (const PlyElement& element : header_.elements) {
      if (element.properties.empty()) continue;
      for (size_t i = 0; i < element.count; ++i) {
        PlyRow row;
        absl::Status status =
            source.BeginRow() ? ReadRow(element, source, row) : absl::OutOfRangeError("");
        if (absl::IsOutOfRange(status)) return Ends(element, i);
        RETURN_IF_ERROR(status);
        RETURN_IF_ERROR(TakeRow(element, row));
      }
    }
    if (source.AtEnd()) return absl::OkStatus();
    return lines_.Unreadable("the file goes on after the last element that its header announces");
  }

  template <typename Source>
  absl::Status ReadRow(const PlyElement& element, Source& source, PlyRow& row) const {
    for (const PlyProperty& property : element.properties) {
      double value = 0;
      if (!property.count_type) {
        RETURN_IF_ERROR(source.Take(property.type, value));
        if (IsCoordinate(property.name))
          row.place[static_cast<size_t>(property.name[0] - 'x')] = value;
        continue;
      }
      double count = 0;
      RETURN_IF_ERROR(source.Take(*property.count_type, count));
      if (!(count >= 0) || count != std::floor(count)) {
        return lines_.Unreadable(absl::StrCat("a list of ", count, " figures"));
      }
      const bool kept = IsCorners(property);
      for (double n = 0; n < count; ++n) {
        RETURN_IF_ERROR(source.Take(property.type, value));
        if (kept) row.list.push_back(value);
      }
    }
    return source.EndRow();
  }

  absl::Status Ends(const PlyElement& element, size_t index) const {
    return lines_.Unreadable(absl::StrCat("the file ends within ", EscapedText(element.name), " ",
                                          index, " of ", element.count));
  }

  absl::Status TakeRow(const PlyElement& element, const PlyRow& row) {
    if (element.name == "vertex") file_.vertices.push_back(row.place);
    const bool is_face = element.name == "face";
    if (!is_face && element.name != "tristrips") return absl::OkStatus();
    std::vector<int32_t> corners;
    for (const double index : row.list) {
      if (index != std::floor(index) || std::abs(index) > std::numeric_limits<int32_t>::max()) {
        return Refusal(
            absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
            absl::StrCat("face ", face_count_, " names vertex ", index, ": export the mesh again"));
      }
      corners.push_back(static_cast<int32_t>(index));
    }
    if (!is_face) {
      AddStrips(corners);
      return absl::OkStatus();
    }
    if (corners.empty()) {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                     absl::StrCat("face ", face_count_,
                                  " (counted from zero) names no vertices: export the mesh again"));
    }
    file_.AddPolygon(corners);
    ++face_count_;
    return absl::OkStatus();
  }

  /// Strips of triangles, each ended by -1. Every second triangle of a strip is turned.
  void AddStrips(std::span<const int32_t> corners) {
    size_t begin = 0;
    for (size_t i = 0; i < corners.size(); ++i) {
      if (corners[i] == -1) begin = i + 1;
      if (corners[i] == -1 || i < begin + 2) continue;
      const bool turned = (i - begin) % 2 == 1;
      const int32_t a = corners[i - 2], b = corners[i - 1];
      if (a == b || b == corners[i] || a == corners[i]) continue;  // joins two strips
      const std::array<int32_t, 3> triangle = {turned ? b : a, turned ? a : b, corners[i]};
      file_.AddPolygon(triangle);
    }
  }

  TextLines lines_;
  PlyHeader header_;
  SurfaceFile file_;
  size_t face_count_ = 0;
};

}  // namespace

absl::StatusOr<SurfaceFile> ParsePly(const std::string& bytes) { return PlyParser(bytes).Parse(); }

}  // namespace carillon::precompute
