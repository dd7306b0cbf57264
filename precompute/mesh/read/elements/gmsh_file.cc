// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/gmsh_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/elements/gmsh41_sections.h"
#include "precompute/mesh/read/elements/gmsh_elements.h"
#include "precompute/mesh/read/text/text_lines.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

class GmshParser {
 public:
  explicit GmshParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<ElementFile> Parse() && {
    if (const size_t first = lines_.rest().find_first_not_of(" \t\r\n");
        first < lines_.rest().size() && lines_.rest()[first] == '(') {
      return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                     "the file is a .msh of Fluent, not of Gmsh: export the body's surface as STL");
    }
    while (const std::optional<std::string_view> section = NextSection()) {
      if (*section == "$NOD" || *section == "$ELM") return Unreadable("its version is 1");
      RETURN_IF_ERROR(ReadSection(*section));
      RETURN_IF_ERROR(EndSection(*section));
    }
    if (!has_format_) return Unreadable("it has no $MeshFormat");
    return std::move(elements_.file);
  }

 private:
  /// Returns the next line that begins with '$', without the blanks behind it.
  std::optional<std::string_view> NextSection() {
    std::string_view line;
    while (lines_.Next(line)) {
      const std::vector<std::string_view> words = TextLines::Words(line);
      if (!words.empty() && words[0].starts_with('$')) return words[0];
    }
    return std::nullopt;
  }

  absl::Status ReadSection(std::string_view section) {
    if (section == "$MeshFormat") return ReadFormat();
    if (section == "$PhysicalNames") return ReadPhysicalNames();
    if (section == "$Entities" && is_41_) return Read41(&Gmsh41Sections::ReadEntities);
    if (section == "$PartitionedEntities" && is_41_) {
      return Read41(&Gmsh41Sections::ReadPartitionedEntities);
    }
    if (section == "$Nodes" || section == "$ParametricNodes") {
      if (!is_41_) return ReadNodes(section != "$Nodes");
      return Read41(&Gmsh41Sections::ReadNodes);
    }
    if (section != "$Elements") return absl::OkStatus();
    return is_41_ ? Read41(&Gmsh41Sections::ReadElements) : ReadElements();
  }

  /// Passes over the rest of a section. The format lets readers ignore sections that they do
  /// not know, but the nodes and elements must end where their numbers say.
  absl::Status EndSection(std::string_view section) {
    const std::string end = "$End" + std::string(section.substr(1));
    const bool is_read =
        section == "$Nodes" || section == "$ParametricNodes" || section == "$Elements";
    std::string_view line;
    while (lines_.Next(line)) {
      const std::vector<std::string_view> words = TextLines::Words(line);
      if (!words.empty() && words[0] == end) return absl::OkStatus();
      if (is_read && !words.empty()) {
        return lines_.Unreadable(absl::StrCat("no ", end, " where the section says that it ends"));
      }
    }
    return Unreadable(absl::StrCat("the file ends before ", EscapedText(end.substr(0, 60))));
  }

  static absl::Status Unreadable(absl::string_view what) {
    return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                   absl::StrCat("the file cannot be read as Gmsh MSH 2.2 or 4.1: ", what,
                                ". Write it by \"gmsh -format msh41\""));
  }

  absl::Status ReadFormat() {
    const auto words = lines_.NextWords();
    if (words.size() != 3) return lines_.Unreadable("no mesh format of Gmsh");
    is_41_ = words[0] == "4.1";
    // Gmsh 2.0 wrote "2".
    if (!is_41_ && words[0] != "2" && !words[0].starts_with("2.")) {
      return Unreadable(absl::StrCat("its version is ", QuotedText(words[0])));
    }
    if (words[2] != "8") return Unreadable("its numbers have not eight bytes");
    has_format_ = true;
    is_binary_ = words[1] == "1";
    int32_t one = 1;
    if (is_binary_ && (!Take(std::span(&one, 1)) || one != 1)) {
      return Unreadable("its bytes are in the other order");
    }
    return absl::OkStatus();
  }

  absl::Status Read41(absl::Status (Gmsh41Sections::*read)(NumberStream&)) {
    NumberStream stream(lines_.rest(), is_binary_);
    absl::Status status = (sections_.*read)(stream);
    lines_.Skip(lines_.rest().size() - stream.rest().size());
    return status;
  }

  absl::StatusOr<size_t> ReadCount() {
    const auto words = lines_.NextWords();
    const auto count = words.empty() ? std::nullopt : ToNumber<size_t>(words[0]);
    if (!has_format_ || !count) return lines_.Unreadable("no number of nodes or elements");
    // A node or an element takes more than eight bytes.
    if (*count > lines_.rest().size() / 8) return Unreadable("the file ends within a section");
    return *count;
  }

  /// "dimension number "name"", text in both kinds of file.
  absl::Status ReadPhysicalNames() {
    const auto words = lines_.NextWords();
    const auto count = words.empty() ? std::nullopt : ToNumber<size_t>(words[0]);
    if (!count) return lines_.Unreadable("no number of physical names");
    for (size_t i = 0; i < *count; ++i) {
      std::string_view line;
      std::array<int32_t, 2> figures{};
      const bool read = lines_.Next(line);
      const auto parts = TextLines::Words(line);
      const size_t open = line.find('"'), close = line.rfind('"');
      if (!read || parts.size() < 3 || !Assign(parts[0], figures[0]) ||
          !Assign(parts[1], figures[1]) || open == close) {
        return lines_.Unreadable("no physical name (\"dimension number \"name\"\")");
      }
      elements_.physical_names[figures] = line.substr(open + 1, close - open - 1);
    }
    return absl::OkStatus();
  }

  /// "number x y z". Parametric nodes go on with the entity on which they lie, and their place on
  /// it.
  absl::Status ReadNodes(bool parametric) {
    if (parametric && is_binary_) {
      return Unreadable(
          "it has binary $ParametricNodes: switch off the option Mesh.SaveParametric, or save "
          "text");
    }
    ASSIGN_OR_RETURN(const size_t count, ReadCount());
    RETURN_IF_ERROR(CheckNodeCountOfFile(count));
    for (size_t i = 0; i < count; ++i) {
      int32_t number = 0;
      Point p;
      if (is_binary_) {
        if (!Take(std::span(&number, 1)) || !Take(std::span(p))) {
          return Unreadable(absl::StrCat("the file ends within node ", i));
        }
      } else {
        const auto words = lines_.NextWords();
        if (words.size() < 4 || (words.size() > 4 && !parametric) || !Assign(words[0], number) ||
            !Assign(words[1], p[0]) || !Assign(words[2], p[1]) || !Assign(words[3], p[2])) {
          return lines_.Unreadable("no node (\"number x y z\")");
        }
      }
      elements_.file.node_numbers.push_back(number);
      elements_.file.nodes.push_back(p);
    }
    return absl::OkStatus();
  }

  absl::Status ReadElements() {
    ASSIGN_OR_RETURN(const size_t count, ReadCount());
    for (size_t i = 0; i < count;) {
      ASSIGN_OR_RETURN(const size_t read, is_binary_ ? ReadBinaryElements() : ReadTextElement());
      i += read;
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
    const GmshKind* kind = FindGmshKind(figures[1]);
    if (kind == nullptr) return UnknownGmshKind(figures[1]);
    const size_t first = 3 + static_cast<size_t>(figures[2]);
    if (figures.size() != first + kind->node_count) {
      return lines_.Unreadable("an element with another number of nodes than its type has");
    }
    const int32_t physical = figures[2] > 0 ? figures[3] : 0;
    RETURN_IF_ERROR(AddElement(*kind, physical, std::span(figures).subspan(first)));
    return 1;
  }

  /// A header of type, number of elements and number of tags, followed by the elements.
  absl::StatusOr<size_t> ReadBinaryElements() {
    std::array<int32_t, 3> header;
    if (!Take(std::span(header)) || header[1] < 1 || header[2] < 0) {
      return Unreadable("the elements end too early");
    }
    const GmshKind* kind = FindGmshKind(header[0]);
    if (kind == nullptr) return UnknownGmshKind(header[0]);
    const size_t first = 1 + static_cast<size_t>(header[2]);
    std::vector<int32_t> figures(std::min(first, lines_.rest().size()) + kind->node_count);
    for (int32_t i = 0; i < header[1]; ++i) {
      if (!Take(std::span(figures))) return Unreadable("the elements end too early");
      const int32_t physical = first > 1 ? figures[1] : 0;
      RETURN_IF_ERROR(AddElement(*kind, physical, std::span(figures).subspan(first)));
    }
    return static_cast<size_t>(header[1]);
  }

  absl::Status AddElement(const GmshKind& kind, int32_t physical, std::span<const int32_t> nodes) {
    const std::vector<int64_t> numbers(nodes.begin(), nodes.end());
    return elements_.Add(kind, std::span(&physical, 1), numbers);
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
  GmshElements elements_;
  Gmsh41Sections sections_{elements_};
  bool is_41_ = false;
  bool has_format_ = false;
  bool is_binary_ = false;
};

}  // namespace

absl::StatusOr<ElementFile> ParseGmsh(const std::string& bytes) {
  return GmshParser(bytes).Parse();
}

}  // namespace carillon::precompute
