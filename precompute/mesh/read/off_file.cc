// SPDX-License-Identifier: AGPL-3.0-or-later
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

using OffWords = std::vector<std::string_view>;

/// What the first word of an OFF file, "[ST][C][N][4]OFF", says of the numbers of each vertex. Some
/// programs write the letters in another order, and all write the numbers in the same.
struct OffKind {
  bool has_weight = false;
  bool has_colour = false;
  size_t other_count = 0;  // of the normal and of the place in a texture

  /// Whether a vertex may have so many numbers. Colours have three or four figures; many programs
  /// write them without the "C" in the first word.
  bool Takes(size_t count) const {
    const size_t least = (has_weight ? 4 : 3) + other_count;
    return count == least || count == least + 3 || count == least + 4;
  }
};

/// Returns nothing for another word, and for "nOFF", whose vertices have any number of dimensions.
std::optional<OffKind> ToOffKind(std::string_view word) {
  OffKind kind;
  const auto take = [&word](std::string_view prefix) {
    const bool begins = word.starts_with(prefix);
    if (begins) word.remove_prefix(prefix.size());
    return begins;
  };
  for (size_t before = 0; before != word.size();) {
    before = word.size();
    if (take("ST")) kind.other_count += 2;
    if (take("C")) kind.has_colour = true;
    if (take("N")) kind.other_count += 3;
    if (take("4")) kind.has_weight = true;
  }
  return word == "OFF" ? std::optional(kind) : std::nullopt;
}

class OffParser {
 public:
  explicit OffParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<SurfaceFile> Parse() && {
    RETURN_IF_ERROR(ReadHeader());
    for (size_t v = 0; v < vertex_count_; ++v) {
      RETURN_IF_ERROR(ReadVertex(v));
    }
    for (size_t f = 0; f < face_count_; ++f) {
      RETURN_IF_ERROR(ReadFace(f));
    }
    if (!lines_.NextWords().empty()) {
      return lines_.Unreadable(
          absl::StrCat("the file goes on after the ", face_count_, " faces that it announced"));
    }
    return std::move(file_);
  }

 private:
  absl::Status ReadHeader() {
    OffWords words = lines_.NextWords();
    // The data sets ModelNet have "OFF490 518 0", and the format lets a file begin with the
    // numbers.
    if (!words.empty() && words[0].starts_with("OFF") && words[0].size() > 3) {
      words[0].remove_prefix(3);
    }
    const bool begins_with_numbers = words.size() > 1 && ToNumber<uint32_t>(words[0]);
    if (begins_with_numbers) words.insert(words.begin(), "OFF");
    const std::optional<OffKind> kind = words.empty() ? std::nullopt : ToOffKind(words[0]);
    if (!kind) {
      return lines_.Unreadable(
          "an OFF file begins with \"OFF\", or with COFF, NOFF, STOFF, 4OFF or several of these "
          "letters");
    }
    kind_ = *kind;
    words.erase(words.begin());
    if (!words.empty() && words[0] == "BINARY") {
      return lines_.Unreadable("binary OFF files are not read: save it as text, or as PLY");
    }
    if (words.empty()) words = lines_.NextWords();
    const auto vertices = words.empty() ? std::nullopt : ToNumber<uint32_t>(words[0]);
    const auto faces = words.size() < 2 ? std::nullopt : ToNumber<uint32_t>(words[1]);
    if (!vertices || !faces) return lines_.Unreadable("no numbers of vertices and faces");
    vertex_count_ = *vertices;
    face_count_ = *faces;
    return absl::OkStatus();
  }

  absl::Status ReadVertex(size_t v) {
    const OffWords words = lines_.NextWords();
    if (words.empty()) return lines_.Unreadable(absl::StrCat("the file ends at vertex ", v));
    if (words.size() < 3) return lines_.Unreadable("a vertex with fewer than three coordinates");
    if (v == 0) number_count_ = words.size();
    if (!kind_.Takes(words.size()) || (!kind_.has_colour && words.size() != number_count_)) {
      return lines_.Unreadable(absl::StrCat(
          "a vertex with ", words.size(),
          " numbers, which the first word of the file does not announce (C for colours, N for "
          "normals, ST for textures, 4 for a weight)"));
    }
    ASSIGN_OR_RETURN(Point p, TakePoint(lines_, words));
    if (kind_.has_weight) {
      const double weight = ToNumber<double>(words[3]).value_or(0);
      if (!(weight > 0)) {
        return lines_.Unreadable(absl::StrCat("a vertex with the weight ", QuotedText(words[3])));
      }
      for (double& x : p) x /= weight;
    }
    file_.vertices.push_back(p);
    return absl::OkStatus();
  }

  /// "corner-count corners [colour]"
  absl::Status ReadFace(size_t f) {
    const OffWords words = lines_.NextWords();
    if (words.empty()) return lines_.Unreadable(absl::StrCat("the file ends at face ", f));
    const std::optional<size_t> corner_count = ToNumber<size_t>(words[0]);
    if (!corner_count || *corner_count >= words.size()) {
      return lines_.Unreadable("a face with fewer corners than it says");
    }
    std::vector<int32_t> polygon;
    for (const std::string_view word : std::span(words).subspan(1, *corner_count)) {
      const std::optional<int64_t> index = ToNumber<int64_t>(word);
      if (!index) return lines_.Unreadable(absl::StrCat(QuotedText(word), " is no vertex"));
      if (*index < 0 || *index >= static_cast<int64_t>(vertex_count_)) {
        return Refusal(absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
                       absl::StrCat("line ", lines_.number(), ": a face names vertex ", *index,
                                    " where there are ", vertex_count_, ": export the mesh again"));
      }
      polygon.push_back(static_cast<int32_t>(*index));
    }
    file_.AddPolygon(polygon);
    return absl::OkStatus();
  }

  TextLines lines_;
  OffKind kind_;
  size_t vertex_count_ = 0, face_count_ = 0;
  size_t number_count_ = 0;  // of the first vertex
  SurfaceFile file_;
};

}  // namespace

absl::StatusOr<SurfaceFile> ParseOff(const std::string& bytes) { return OffParser(bytes).Parse(); }

}  // namespace carillon::precompute
