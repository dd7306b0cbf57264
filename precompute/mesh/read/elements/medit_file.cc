// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/medit_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/text/number_stream.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// The layout of a section: the number of nodes of each entry, and how many of them are corners.
struct MeditKind {
  std::string_view keyword;
  int dimension;
  size_t node_count;
  size_t corner_count;
};

constexpr std::array<MeditKind, 7> kMeditKinds = {{{"Edges", 1, 2, 2},
                                                   {"EdgesP2", 1, 3, 2},
                                                   {"Triangles", 2, 3, 3},
                                                   {"TrianglesP2", 2, 6, 3},
                                                   {"Quadrilaterals", 2, 4, 4},
                                                   {"Tetrahedra", 3, 4, 4},
                                                   {"TetrahedraP2", 3, 10, 4}}};

/// Beginnings of the names of sections with elements and faces. Those that kMeditKinds does not
/// have are not read.
constexpr std::array<std::string_view, 8> kElementNames = {"Hexahedra", "Prisms",    "Pyramids",
                                                           "Polyhedra", "Polygons",  "Triangles",
                                                           "Quadrilat", "Tetrahedra"};

/// Whether a word of the file is a keyword. Some programs write keywords in lower case.
bool Same(std::string_view word, std::string_view keyword) {
  return absl::EqualsIgnoreCase({word.data(), word.size()}, {keyword.data(), keyword.size()});
}

class MeditParser {
 public:
  explicit MeditParser(const std::string& bytes) : bytes_(bytes), stream_(bytes, false) {}

  absl::StatusOr<ElementFile> Parse() && {
    int version = 0;
    if (!Same(stream_.NextWord(), "MeshVersionFormatted") || !stream_.Take(version)) {
      return Unreadable("it is no text of Medit");
    }
    for (std::string_view word = stream_.NextWord(); !word.empty() && !Same(word, "End");
         word = stream_.NextWord()) {
      if (std::isalpha(static_cast<unsigned char>(word[0])) == 0) {
        return Unreadable(absl::StrCat(QuotedText(word), " where a section begins"));
      }
      RETURN_IF_ERROR(ReadSection(word));
    }
    ChooseGroups();
    return std::move(file_);
  }

 private:
  absl::Status Unreadable(absl::string_view what) const {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   absl::StrCat("the file cannot be read as Medit's .mesh: line ",
                                LineOf(bytes_, stream_.rest()), ": ", what,
                                ". Export the mesh again, as text"));
  }

  absl::Status ReadSection(std::string_view keyword) {
    if (Same(keyword, "Dimension")) return ReadDimension();
    if (Same(keyword, "Vertices")) return ReadVertices();
    const auto* kind = std::ranges::find_if(
        kMeditKinds, [&](std::string_view known) { return Same(keyword, known); },
        &MeditKind::keyword);
    if (kind != kMeditKinds.end()) return ReadElements(*kind);
    uint64_t count = 0;
    const bool has_elements = std::ranges::any_of(kElementNames, [&](std::string_view name) {
      return Same(keyword.substr(0, name.size()), name);
    });
    if (has_elements && stream_.Take(count) && count > 0) {
      return UnsupportedElements(EscapedText(keyword.substr(0, 60)));
    }
    // Skips any other section up to the next keyword.
    for (std::string_view word = stream_.PeekWord();
         !word.empty() && std::isalpha(static_cast<unsigned char>(word[0])) == 0;
         word = stream_.PeekWord()) {
      stream_.NextWord();
    }
    return absl::OkStatus();
  }

  absl::Status ReadDimension() {
    int dimension = 0;
    if (!stream_.Take(dimension) || dimension != 3) return Unreadable("its dimension is not 3");
    return absl::OkStatus();
  }

  absl::Status ReadVertices() {
    uint64_t count = 0;
    if (!stream_.Take(count)) return Unreadable("no number of vertices");
    RETURN_IF_ERROR(CheckNodeCountOfFile(count));
    for (uint64_t i = 0; i < count; ++i) {
      Point p{};
      int64_t reference = 0;
      if (!stream_.TakeAll(p) || !stream_.Take(reference)) {
        return Unreadable("no vertex (\"x y z reference\")");
      }
      const auto number = static_cast<int64_t>(file_.nodes.size()) + 1;
      file_.node_numbers.push_back(number);
      file_.nodes.push_back(p);
      AddTo(0, reference, std::span(&number, 1));
    }
    return absl::OkStatus();
  }

  absl::Status ReadElements(const MeditKind& kind) {
    uint64_t count = 0;
    if (!stream_.Take(count)) return Unreadable("no number of elements");
    std::vector<int64_t> nodes(kind.node_count);
    for (uint64_t i = 0; i < count; ++i) {
      int64_t reference = 0;
      if (!stream_.TakeAll(nodes) || !stream_.Take(reference)) {
        return Unreadable(absl::StrCat("no entry of ",
                                       absl::string_view(kind.keyword.data(), kind.keyword.size()),
                                       " (nodes, then the reference)"));
      }
      if (kind.dimension == 3) {
        RETURN_IF_ERROR(file_.AddTetrahedron(nodes, {absl::StrCat(reference)}));
        continue;
      }
      AddTo(kind.dimension, reference, std::span(nodes).first(kind.corner_count));
      if (kind.dimension == 2) AddFace(reference, nodes);
    }
    return absl::OkStatus();
  }

  /// Adds a triangle of first order. A curved triangle is represented by its corners, because Medit
  /// uses surfaces for display only.
  void AddFace(int64_t reference, const std::vector<int64_t>& n) {
    const std::vector<std::string> names = Names(2, reference);
    const std::array<std::array<int64_t, 3>, 1> first = {{{n[0], n[1], n[2]}}};
    file_.AddTriangles(names, first);
    if (n.size() != 4) return;
    const std::array<std::array<int64_t, 3>, 1> second = {{{n[0], n[2], n[3]}}};
    file_.AddTriangles(names, second);
  }

  void AddTo(int dimension, int64_t reference, std::span<const int64_t> corners) {
    file_.AddToGroups(Names(dimension, reference), corners);
  }

  /// Names that distinguish the kinds until all groups are known.
  static std::vector<std::string> Names(int dimension, int64_t reference) {
    if (reference == 0) return {};
    return {absl::StrCat(dimension, " ", reference)};
  }

  /// Keeps only the group of the highest dimension among the groups with one number.
  void ChooseGroups() {
    std::ranges::sort(file_.groups, std::greater<>(), &ElementFile::Group::name);
    std::vector<ElementFile::Group> chosen;
    for (ElementFile::Group& group : file_.groups) {
      group.name.erase(0, 2);
      if (std::ranges::find(chosen, group.name, &ElementFile::Group::name) == chosen.end()) {
        chosen.push_back(std::move(group));
      }
    }
    file_.groups = std::move(chosen);
  }

  const std::string& bytes_;
  NumberStream stream_;
  ElementFile file_;
};

}  // namespace

absl::StatusOr<ElementFile> ParseMedit(const std::string& bytes) {
  return MeditParser(bytes).Parse();
}

}  // namespace carillon::precompute
