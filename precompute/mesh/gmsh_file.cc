// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/gmsh_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/mesh_limits.h"
#include "precompute/mesh/text_lines.h"
#include "proto/error_reason.h"

namespace carillon::precompute {
namespace {

constexpr int kTetrahedron4 = 4, kTetrahedron10 = 11;

/// Nodes of the elements we know by their type in the file, from 0; 0 for those we do not take.
constexpr std::array<int, 17> kNodesOfType = {0, 2, 3, 4, 4, 0, 0, 0, 3, 6, 9, 10, 0, 0, 0, 1, 8};

std::optional<int> NodesOfType(int type) {
  if (type < 0 || type >= static_cast<int>(kNodesOfType.size())) return std::nullopt;
  const int nodes = kNodesOfType[static_cast<size_t>(type)];
  return nodes == 0 ? std::nullopt : std::optional(nodes);
}

class Parser {
 public:
  explicit Parser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<GmshFile> Parse() && {
    std::string_view line;
    while (lines_.Next(line)) {
      absl::Status status = absl::OkStatus();
      if (line == "$MeshFormat") status = ReadFormat();
      if (line == "$Nodes") status = ReadNodes();
      if (line == "$Elements") status = ReadElements();
      if (!status.ok()) return status;
    }
    if (!has_format_) return Unreadable("it has no $MeshFormat");
    return std::move(file_);
  }

 private:
  static absl::Status Unreadable(absl::string_view what) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   absl::StrCat("the file cannot be read as Gmsh MSH 2.2: ", what,
                                ". Write it by \"gmsh -format msh22\""));
  }

  static absl::Status Unsupported(absl::string_view what) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_ELEMENT_UNSUPPORTED",
                   absl::StrCat("the file has ", what,
                                ": mesh the volume with tetrahedra of 4 or of 10 nodes alone"));
  }

  absl::Status ReadFormat() {
    const auto words = lines_.NextWords();
    if (words.size() != 3) return lines_.Unreadable("no mesh format of Gmsh");
    if (!words[0].starts_with("2.")) {
      return Unreadable(
          absl::StrCat("its version is ", absl::string_view(words[0].data(), words[0].size())));
    }
    has_format_ = true;
    is_binary_ = words[1] == "1";
    int32_t one = 1;
    if (is_binary_ && (!Take(std::span(&one, 1)) || one != 1)) {
      return Unreadable("its bytes are in the other order");
    }
    return absl::OkStatus();
  }

  absl::StatusOr<size_t> ReadCount() {
    const auto words = lines_.NextWords();
    const auto count = words.empty() ? std::nullopt : ToNumber<size_t>(words[0]);
    if (!has_format_ || !count) return lines_.Unreadable("no number of nodes or elements");
    // A node or an element takes more than eight bytes.
    if (*count > lines_.rest().size() / 8) return Unreadable("the file ends within a section");
    return *count;
  }

  absl::Status ReadNodes() {
    const absl::StatusOr<size_t> count = ReadCount();
    if (!count.ok()) return count.status();
    if (*count > kMaxMeshNodes) {
      return Refusal(absl::StatusCode::kResourceExhausted, "MESH_TOO_LARGE",
                     absl::StrCat("the mesh has ", *count, " nodes; the limit is ", kMaxMeshNodes,
                                  ": give a coarser mesh"));
    }
    for (size_t i = 0; i < *count; ++i) {
      int32_t number = 0;
      Point p;
      if (is_binary_) {
        if (!Take(std::span(&number, 1)) || !Take(std::span(p))) {
          return Unreadable(absl::StrCat("the file ends within node ", i));
        }
      } else {
        const auto words = lines_.NextWords();
        if (words.size() != 4 || !Assign(words[0], number) || !Assign(words[1], p[0]) ||
            !Assign(words[2], p[1]) || !Assign(words[3], p[2])) {
          return lines_.Unreadable("no node (\"number x y z\")");
        }
      }
      file_.node_numbers.push_back(number);
      file_.nodes.push_back(p);
    }
    return absl::OkStatus();
  }

  absl::Status ReadElements() {
    const absl::StatusOr<size_t> count = ReadCount();
    if (!count.ok()) return count.status();
    for (size_t i = 0; i < *count;) {
      const absl::StatusOr<size_t> read = is_binary_ ? ReadBinaryElements() : ReadTextElement();
      if (!read.ok()) return read.status();
      i += *read;
    }
    return absl::OkStatus();
  }

  /// "number type tag-count tags nodes"
  absl::StatusOr<size_t> ReadTextElement() {
    std::vector<int32_t> figures;
    for (const std::string_view word : lines_.NextWords()) {
      if (!Assign(word, figures.emplace_back())) return lines_.Unreadable("no element");
    }
    if (figures.size() < 3 || figures[2] < 0) return lines_.Unreadable("no element");
    const std::optional<int> node_count = NodesOfType(figures[1]);
    if (!node_count) return Unsupported(absl::StrCat("an element of Gmsh's type ", figures[1]));
    const size_t first = 3 + static_cast<size_t>(figures[2]);
    if (figures.size() != first + static_cast<size_t>(*node_count)) {
      return lines_.Unreadable("an element with another number of nodes than its type has");
    }
    if (absl::Status status = AddElement(figures[1], std::span(figures).subspan(first));
        !status.ok()) {
      return status;
    }
    return 1;
  }

  /// A header of type, number of elements and number of tags, then so many elements.
  absl::StatusOr<size_t> ReadBinaryElements() {
    std::array<int32_t, 3> header;
    if (!Take(std::span(header)) || header[1] < 1 || header[2] < 0) {
      return Unreadable("the elements end too early");
    }
    const std::optional<int> node_count = NodesOfType(header[0]);
    if (!node_count) return Unsupported(absl::StrCat("an element of Gmsh's type ", header[0]));
    const size_t first = 1 + static_cast<size_t>(header[2]);
    std::vector<int32_t> figures(std::min(first, lines_.rest().size()) +
                                 static_cast<size_t>(*node_count));
    for (int32_t i = 0; i < header[1]; ++i) {
      if (!Take(std::span(figures))) return Unreadable("the elements end too early");
      absl::Status status = AddElement(header[0], std::span(figures).subspan(first));
      if (!status.ok()) return status;
    }
    return static_cast<size_t>(header[1]);
  }

  absl::Status AddElement(int type, std::span<const int32_t> nodes) {
    if (type != kTetrahedron4 && type != kTetrahedron10) return absl::OkStatus();
    const auto count = static_cast<int>(nodes.size());
    if (file_.nodes_per_element != 0 && file_.nodes_per_element != count) {
      return Unsupported("tetrahedra of 4 and of 10 nodes");
    }
    file_.nodes_per_element = count;
    file_.elements.insert(file_.elements.end(), nodes.begin(), nodes.end());
    return absl::OkStatus();
  }

  template <typename T>
  static bool Assign(std::string_view word, T& value) {
    const std::optional<T> number = ToNumber<T>(word);
    if (number) value = *number;
    return number.has_value();
  }

  template <typename T, size_t N>
  bool Take(std::span<T, N> values) {
    if (lines_.rest().size() < values.size_bytes()) return false;
    std::memcpy(values.data(), lines_.rest().data(), values.size_bytes());
    lines_.Skip(values.size_bytes());
    return true;
  }

  TextLines lines_;
  GmshFile file_;
  bool has_format_ = false;
  bool is_binary_ = false;
};

}  // namespace

absl::StatusOr<GmshFile> ParseGmsh(const std::string& bytes) { return Parser(bytes).Parse(); }

}  // namespace carillon::precompute
