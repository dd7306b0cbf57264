// SPDX-License-Identifier: AGPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/surface_file.h"
#include "precompute/mesh/read/text/number_stream.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr size_t kStlTitle = 80, kStlHeader = 84, kStlTriangle = 50;  // bytes

absl::Status StlUnreadable(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                 absl::StrCat("the file cannot be read as STL: ", what,
                              ". Name its right format, or export it again"));
}

/// The number of triangles that a binary solid says it has. Programs that write while they compute
/// leave 0 or the greatest number there; then all that follows are triangles.
size_t TriangleCountOf(std::string_view solid) {
  uint32_t count = 0;
  std::memcpy(&count, solid.data() + kStlTitle, sizeof count);
  const size_t byte_count = solid.size() - kStlHeader;
  const bool is_unknown = count == 0 || count == std::numeric_limits<uint32_t>::max();
  return is_unknown && byte_count % kStlTriangle == 0 ? byte_count / kStlTriangle : count;
}

/// Titles of binary files may begin with "solid", too, but a text has no zero bytes.
bool IsStlText(std::string_view bytes) {
  const size_t begin = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const std::string first = absl::AsciiStrToLower(std::string(bytes.substr(begin, 5)));
  if (first != "solid") return false;
  if (bytes.size() >= kStlHeader &&
      bytes.size() == kStlHeader + kStlTriangle * TriangleCountOf(bytes)) {
    return false;
  }
  return bytes.substr(0, 512).find('\0') == std::string_view::npos;
}

/// "solid NAME", facets of "outer loop", vertices and "endloop", and "endsolid NAME", in any case
/// of letters. A file may have several solids.
class StlText {
 public:
  explicit StlText(const std::string& bytes) : bytes_(bytes), stream_(bytes, false) {}

  absl::StatusOr<SurfaceFile> Parse() && {
    file_.has_numbers = false;
    bool has_ended = false;
    for (std::string word = Next(); !word.empty(); word = Next()) {
      if (word == "facet") {
        RETURN_IF_ERROR(ReadFacet());
      } else if (word == "solid" || word == "endsolid") {
        const std::string_view rest = stream_.rest();
        const absl::string_view name(rest.data(),
                                     std::min(rest.size(), rest.find_first_of("\r\n")));
        if (word == "solid") file_.EnterRegion({std::string(absl::StripAsciiWhitespace(name))});
        stream_.SkipLine();
        has_ended = word == "endsolid";
      } else if (has_ended && absl::AsciiStrToLower(std::string(stream_.rest())).find("facet") ==
                                  std::string::npos) {
        file_.warnings.emplace_back("what follows the last solid of the file was left out");
        break;
      } else {
        return Fault(absl::StrCat(HasEnded() ? "the file ends" : QuotedText(word),
                                  " where a facet or the end of the solid belongs"));
      }
    }
    return std::move(file_);
  }

 private:
  std::string Next() { return absl::AsciiStrToLower(std::string(stream_.NextWord())); }

  /// Whether nothing follows the last word, of which a file that was cut may have the beginning.
  bool HasEnded() { return stream_.PeekWord().empty(); }

  absl::Status Fault(absl::string_view what) const {
    return StlUnreadable(absl::StrCat("line ", LineOf(bytes_, stream_.rest()), ": ", what));
  }

  absl::Status Expect(const char* word) {
    const std::string found = Next();
    if (found == word) return absl::OkStatus();
    return Fault(absl::StrCat(HasEnded() ? "the file ends" : QuotedText(found), " where \"", word,
                              "\" belongs"));
  }

  absl::Status ReadFacet() {
    RETURN_IF_ERROR(Expect("normal"));
    // The three figures of the normal follow from the corners; some programs write "nan".
    for (int i = 0; i < 3; ++i) Next();
    for (const char* word : {"outer", "loop"}) {
      RETURN_IF_ERROR(Expect(word));
    }
    std::vector<int32_t> polygon;
    std::string word = Next();
    for (; word == "vertex"; word = Next()) {
      Point p{};
      if (!stream_.TakeAll(p)) {
        return Fault(HasEnded() ? "the file ends within a vertex" : "no vertex (\"vertex x y z\")");
      }
      polygon.push_back(static_cast<int32_t>(file_.vertices.size()));
      file_.vertices.push_back(p);
    }
    if (word != "endloop") {
      return Fault(HasEnded() ? "the file ends within a facet"
                              : absl::StrCat(QuotedText(word), " where \"endloop\" belongs"));
    }
    if (polygon.size() < 3) return Fault("a facet with fewer than three vertices");
    file_.AddPolygon(polygon);
    return Expect("endfacet");
  }

  const std::string& bytes_;
  NumberStream stream_;
  SurfaceFile file_;
};

void AddBinarySolid(std::string_view triangles, SurfaceFile& file) {
  for (; !triangles.empty(); triangles.remove_prefix(kStlTriangle)) {
    std::array<float, 12> figures;  // normal and corners
    std::memcpy(figures.data(), triangles.data(), sizeof figures);
    std::array<Point, 3> corners;
    for (size_t i = 0; i < 9; ++i) corners[i / 3][i % 3] = figures[i + 3];
    file.AddTriangle(corners);
  }
}

/// Reads solids, each with a title and a number of triangles, one after the other.
absl::StatusOr<SurfaceFile> ParseBinaryStl(std::string_view rest) {
  SurfaceFile file;
  file.has_numbers = false;
  for (bool first = true; first || rest.size() >= kStlHeader; first = false) {
    // Numbers in binary have zero bytes.
    if (rest.size() < kStlHeader || (first && rest.find('\0') == std::string_view::npos))
      return StlUnreadable("it begins neither with \"solid\" nor with a title of 80 bytes");
    const size_t count = TriangleCountOf(rest);
    file.EnterRegion({absl::StrCat(file.regions.size())});
    if (kStlHeader + kStlTriangle * count > rest.size()) {
      return StlUnreadable(absl::StrCat("its header says that it has ", count, " triangles, and ",
                                        (rest.size() - kStlHeader) / kStlTriangle, " follow"));
    }
    AddBinarySolid(rest.substr(kStlHeader, kStlTriangle * count), file);
    rest.remove_prefix(kStlHeader + kStlTriangle * count);
    const bool is_padding =
        rest.find_first_not_of(std::string_view(" \t\r\n\0", 5)) == std::string_view::npos;
    if (rest.empty() || is_padding) return file;
  }
  file.warnings.push_back(
      absl::StrCat(rest.size(), " bytes after the last triangle were left out"));
  return file;
}

}  // namespace

absl::StatusOr<SurfaceFile> ParseStl(const std::string& bytes) {
  return IsStlText(bytes) ? StlText(bytes).Parse() : ParseBinaryStl(bytes);
}

}  // namespace carillon::precompute
