// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/tetgen_file.h"

#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/text/text_lines.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Positions at which TetGen writes the mid-side nodes of a ten-node tetrahedron, in the order of
/// TetMesh's edges.
constexpr std::array<size_t, 6> kMidsides = {6, 7, 9, 5, 8, 4};

class TetgenParser {
 public:
  explicit TetgenParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<ElementFile> Parse() && {
    for (const auto read : {&TetgenParser::ReadNodes, &TetgenParser::ReadElements}) {
      RETURN_IF_ERROR((this->*read)());
    }
    return std::move(file_);
  }

 private:
  /// A line of whole numbers, at least `least` of them.
  absl::StatusOr<std::vector<int64_t>> NextFigures(size_t least, absl::string_view what) {
    std::vector<int64_t> figures;
    words_ = lines_.NextWords();
    for (const std::string_view word : words_) {
      // Attributes, which come last, need not be whole.
      const auto figure = ToNumber<int64_t>(word);
      if (!figure) break;
      figures.push_back(*figure);
    }
    if (figures.size() < least) return lines_.Unreadable(what);
    return figures;
  }

  /// "nodes dimension attributes markers", then "number x y z attributes marker" each.
  absl::Status ReadNodes() {
    ASSIGN_OR_RETURN(const auto header,
                     NextFigures(1, "no number of nodes, with which a .node file begins"));
    const int64_t count = header.front();
    if (count < 1 || (header.size() > 1 && header[1] != 3)) {
      return lines_.Unreadable("no nodes in three dimensions");
    }
    RETURN_IF_ERROR(CheckNodeCountOfFile(static_cast<size_t>(count)));
    const bool has_markers = header.size() > 3 && header[3] > 0;
    for (int64_t i = 0; i < count; ++i) {
      if (!ReadNode(has_markers)) {
        return lines_.Unreadable(has_markers ? "no node (\"number x y z [attributes] marker\")"
                                             : "no node (\"number x y z [attributes]\")");
      }
    }
    return absl::OkStatus();
  }

  bool ReadNode(bool has_marker) {
    const auto words = lines_.NextWords();
    if (words.size() < (has_marker ? 5 : 4)) return false;
    const auto number = ToNumber<int64_t>(words[0]);
    Point p{};
    for (size_t x = 0; x < 3; ++x) {
      const auto coordinate = ToNumber<double>(words[x + 1]);
      if (!coordinate) return false;
      p[x] = *coordinate;
    }
    const auto marker = has_marker ? ToNumber<int64_t>(words.back()) : 0;
    if (!number || !marker) return false;
    file_.node_numbers.push_back(*number);
    file_.nodes.push_back(p);
    if (*marker != 0) {
      const std::string name = absl::StrCat(*marker);
      file_.AddToGroups(std::span(&name, 1), std::span(&*number, 1));
    }
    return true;
  }

  /// "tetrahedra nodes-of-each attributes", then "number nodes attributes" each.
  absl::Status ReadElements() {
    ASSIGN_OR_RETURN(
        const auto header,
        NextFigures(2,
                    "no numbers of tetrahedra and of their nodes, with which a .ele file begins"));
    const int64_t node_count = header[1];
    if (node_count != 4 && node_count != 10) {
      return UnsupportedElements(absl::StrCat("tetrahedra of ", node_count, " nodes"));
    }
    for (int64_t i = 0; i < header.front(); ++i) {
      ASSIGN_OR_RETURN(const auto figures,
                       NextFigures(static_cast<size_t>(node_count) + 1,
                                   "no tetrahedron (\"number nodes [attribute]\")"));
      RETURN_IF_ERROR(AddTetrahedron(figures, node_count));
    }
    if (!lines_.NextWords().empty()) {
      return lines_.Unreadable(absl::StrCat("the file goes on after the ", header.front(),
                                            " tetrahedra that it announced"));
    }
    return absl::OkStatus();
  }

  absl::Status AddTetrahedron(const std::vector<int64_t>& figures, int64_t node_count) {
    std::vector<int64_t> nodes(figures.begin() + 1, figures.begin() + 5);
    if (node_count == 10) {
      for (const size_t k : kMidsides) nodes.push_back(figures[1 + k]);
    }
    const auto attribute = static_cast<size_t>(node_count) + 1;
    std::string region;
    if (figures.size() > attribute) {
      region = absl::StrCat(figures[attribute]);
    } else if (words_.size() > attribute) {  // "2.0" is the region 2
      const auto number = ToNumber<double>(words_[attribute]);
      region = number ? absl::StrCat(*number) : std::string(words_[attribute]);
    }
    return file_.AddTetrahedron(nodes, {region});
  }

  TextLines lines_;
  std::vector<std::string_view> words_;  // those of the line that NextFigures took last
  ElementFile file_;
};

}  // namespace

absl::StatusOr<ElementFile> ParseTetgen(const std::string& bytes) {
  return TetgenParser(bytes).Parse();
}

}  // namespace carillon::precompute
