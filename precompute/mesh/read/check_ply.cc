// SPDX-License-Identifier: AGPL-3.0-or-later
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/clean_surface_file.h"
#include "precompute/mesh/read/text_lines.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

struct Property {
  std::string_view count_type;  // of a list; else empty
  std::string_view type;
  std::string_view name;
};

struct Element {
  std::string_view name;
  size_t count;
  std::vector<Property> properties;
};

struct Header {
  std::string_view format;
  std::vector<Element> elements;
};

std::optional<size_t> SizeOf(std::string_view type) {
  static const std::map<std::string_view, size_t> sizes = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = sizes.find(type);
  if (found == sizes.end()) return std::nullopt;
  return found->second;
}

/// One line of the header: "element vertex 8", "property list uchar int vertex_indices".
bool ReadHeaderLine(const std::vector<std::string_view>& words, Header& header) {
  if (words[0] == "format" && words.size() >= 2) {
    header.format = words[1];
  } else if (words[0] == "element" && words.size() == 3) {
    const auto count = ToNumber<size_t>(words[2]);
    if (!count) return false;
    header.elements.push_back({words[1], *count, {}});
  } else if (words[0] == "property" && !header.elements.empty()) {
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (!is_list && words.size() != 3) return false;
    const Property property =
        is_list ? Property{words[2], words[3], words[4]} : Property{{}, words[1], words[2]};
    if (!SizeOf(property.type) || (is_list && !SizeOf(property.count_type))) return false;
    header.elements.back().properties.push_back(property);
  } else {
    // Old exporters of Blender write their name before the elements without "comment".
    return words[0] == "comment" || words[0] == "obj_info" || header.elements.empty();
  }
  return true;
}

absl::StatusOr<Header> ReadHeader(TextLines& lines) {
  std::string_view line;
  if (!lines.Next(line) || (line != "ply" && line != "PLY")) {
    return lines.Unreadable("a PLY file begins with \"ply\"");
  }
  Header header;
  while (lines.Next(line)) {
    const std::vector<std::string_view> words = TextLines::Words(line);
    if (words.empty()) continue;
    if (words[0] == "end_header") return header;
    if (!ReadHeaderLine(words, header)) return lines.Unreadable("no line of a PLY header");
  }
  return lines.Unreadable("the file ends within its header");
}

absl::Status Ends(const TextLines& lines, const Element& element, size_t index) {
  return lines.Unreadable(absl::StrCat("the file ends within ",
                                       absl::string_view(element.name.data(), element.name.size()),
                                       " ", index, " of ", element.count));
}

absl::Status CheckText(const Header& header, TextLines& lines) {
  for (const Element& element : header.elements) {
    for (size_t i = 0; i < element.count; ++i) {
      std::string_view line;
      std::vector<std::string_view> words;
      while (words.empty() && lines.Next(line)) words = TextLines::Words(line);
      if (words.empty()) return Ends(lines, element, i);
      size_t next = 0;
      for (const Property& property : element.properties) {
        size_t count = 1;
        if (!property.count_type.empty()) {
          if (next < words.size()) count = ToNumber<size_t>(words[next]).value_or(words.size());
          ++next;
        }
        if (count > words.size()) return lines.Unreadable("a list shorter than it says");
        next += count;
      }
      if (next > words.size()) return lines.Unreadable("fewer figures than the header says");
    }
  }
  return absl::OkStatus();
}

/// The unsigned integer of `size` bytes; a count that was written signed is never negative.
size_t ReadCount(const char* bytes, size_t size, bool big_endian) {
  size_t value = 0;
  for (size_t i = 0; i < size; ++i) {
    const auto byte = static_cast<unsigned char>(bytes[big_endian ? i : size - 1 - i]);
    value = value << 8 | byte;
  }
  return value;
}

absl::Status CheckBinary(const Header& header, const TextLines& lines) {
  const std::string_view body = lines.rest();
  const bool big_endian = header.format == "binary_big_endian";
  size_t next = 0;
  for (const Element& element : header.elements) {
    for (size_t i = 0; i < element.count; ++i) {
      for (const Property& property : element.properties) {
        size_t count = 1;
        if (!property.count_type.empty()) {
          const size_t size = *SizeOf(property.count_type);
          if (size > body.size() - next) return Ends(lines, element, i);
          count = ReadCount(body.data() + next, size, big_endian);
          next += size;
        }
        const size_t size = *SizeOf(property.type);
        if (count > (body.size() - next) / size) return Ends(lines, element, i);
        next += count * size;
      }
      if (element.properties.empty()) break;
    }
  }
  return absl::OkStatus();
}

absl::Status CheckHasSurface(const Header& header, const TextLines& lines) {
  bool has_faces = false;
  size_t coordinate_count = 0;
  for (const Element& element : header.elements) {
    for (const Property& property : element.properties) {
      if (element.name == "vertex") {
        coordinate_count += property.name == "x" || property.name == "y" || property.name == "z";
      }
      if (element.name == "face") {
        has_faces |= !property.count_type.empty() &&
                     (property.name == "vertex_indices" || property.name == "vertex_index");
      }
    }
  }
  if (coordinate_count == 3 && has_faces) return absl::OkStatus();
  return lines.Unreadable(
      "the header names no vertices with x, y, z or no faces with vertex_indices");
}

}  // namespace

absl::Status CheckPly(const std::string& bytes) {
  TextLines lines(bytes);
  ASSIGN_OR_RETURN(const Header header, ReadHeader(lines));
  RETURN_IF_ERROR(CheckHasSurface(header, lines));
  if (header.format == "ascii") return CheckText(header, lines);
  if (header.format == "binary_little_endian" || header.format == "binary_big_endian") {
    return CheckBinary(header, lines);
  }
  return lines.Unreadable(
      "its format is neither ascii nor binary_little_endian nor binary_big_endian");
}

}  // namespace carillon::precompute
