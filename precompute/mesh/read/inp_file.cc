// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/inp_file.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "precompute/mesh/read/text_lines.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// The layout of an element: its dimension, its nodes, and how many of them are corners.
struct InpKind {
  int dimension;
  size_t node_count;
  size_t corner_count;
};

/// Faces of shells, membranes, plane and rigid elements, by the number in their name.
std::optional<InpKind> FaceKind(int number) {
  if (number == 3) return InpKind{2, 3, 3};
  if (number == 4) return InpKind{2, 4, 4};
  if (number == 6 || number == 65) return InpKind{2, 6, 3};
  if (number == 8) return InpKind{2, 8, 4};
  return std::nullopt;
}

/// The kind of elements of a type such as C3D10, CPS6 or S4R; none for one that is no simplex and
/// no face, which has no place in a mesh of tetrahedra.
std::optional<InpKind> KindOf(absl::string_view type) {
  // The letters before the number, and the "3D" that belongs to them.
  const size_t letters = std::min(type.find_first_of("0123456789"), type.size());
  size_t end = letters;
  if (type.substr(letters, 2) == "3D") end += 2;
  const absl::string_view family = type.substr(0, end);
  const size_t digits = std::min(type.find_first_not_of("0123456789", end), type.size()) - end;
  const int number = ToNumber<int>(std::string_view(type.data() + end, digits)).value_or(0);
  if (family == "C3D" && number == 4) return InpKind{3, 4, 4};
  if (family == "C3D" && number == 10) return InpKind{3, 10, 4};
  if (family == "T3D" && number == 2) return InpKind{1, 2, 2};
  if (family == "T3D" && number == 3) return InpKind{1, 3, 2};
  constexpr std::array<absl::string_view, 7> kFaces = {"S",   "STRI", "CPS",  "CPE",
                                                       "M3D", "R3D",  "SFM3D"};
  if (std::ranges::find(kFaces, family) != kFaces.end()) return FaceKind(number);
  return std::nullopt;
}

/// A keyword line: "*ELEMENT, TYPE=C3D4, ELSET=BODY". Keywords and parameters are in capitals.
struct Keyword {
  std::string name;
  std::map<std::string, std::string> parameters;

  std::string Of(const std::string& parameter) const {
    const auto found = parameters.find(parameter);
    return found == parameters.end() ? "" : found->second;
  }
  bool Has(const std::string& parameter) const { return parameters.contains(parameter); }
};

Keyword ParseKeyword(absl::string_view line) {
  Keyword keyword;
  for (const absl::string_view part : absl::StrSplit(line.substr(1), ',')) {
    const std::pair<absl::string_view, absl::string_view> pair =
        absl::StrSplit(part, absl::MaxSplits('=', 1));
    const std::string name = absl::AsciiStrToUpper(absl::StripAsciiWhitespace(pair.first));
    absl::string_view value = absl::StripAsciiWhitespace(pair.second);
    if (value.size() > 1 && value.front() == '"' && value.back() == '"') {
      value = value.substr(1, value.size() - 2);
    }
    if (keyword.name.empty()) {
      keyword.name = name;
    } else if (!name.empty()) {
      keyword.parameters[name] = std::string(value);
    }
  }
  return keyword;
}

class InpParser {
 public:
  explicit InpParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<ElementFile> Parse() && {
    std::string_view line;
    while (lines_.Next(line)) {
      const absl::string_view text = absl::StripAsciiWhitespace({line.data(), line.size()});
      if (text.empty() || absl::StartsWith(text, "**")) continue;
      RETURN_IF_ERROR(text[0] == '*' ? Begin(text) : Take(text));
    }
    RETURN_IF_ERROR(EndBlock());
    return std::move(file_);
  }

 private:
  /// An element by its number, for the sets that name it.
  struct Placed {
    std::vector<int64_t> corners;
    size_t first_triangle;
    size_t end_triangle;
  };

  /// Begins the block of a keyword line, which goes on in the next line after a comma at its end.
  absl::Status Begin(absl::string_view line) {
    RETURN_IF_ERROR(EndBlock());
    std::string joined(line);
    std::string_view more;
    while (joined.ends_with(',') && lines_.Next(more)) {
      absl::StrAppend(&joined, absl::StripAsciiWhitespace({more.data(), more.size()}));
    }
    keyword_ = ParseKeyword(joined);
    for (const char* other : {"SYSTEM", "INCLUDE", "NGEN", "NFILL", "NCOPY", "ELGEN", "ELCOPY"}) {
      if (keyword_.name == other) return NotInOneFile(absl::StrCat("*", other));
    }
    if (keyword_.name == "PART" && ++part_count_ > 1) return NotInOneFile("a second *PART");
    if (keyword_.Has("INPUT")) return NotInOneFile("INPUT=");
    return keyword_.name == "ELEMENT" ? BeginElements() : absl::OkStatus();
  }

  absl::Status NotInOneFile(absl::string_view what) const {
    return lines_.Unreadable(
        absl::StrCat("it has ", what,
                     "; only files with all nodes and elements of one body written out are read"));
  }

  absl::Status BeginElements() {
    const std::string type = absl::AsciiStrToUpper(keyword_.Of("TYPE"));
    kind_ = KindOf(type);
    if (kind_ || !absl::StrContains(type, "C3D")) return absl::OkStatus();
    return UnsupportedElements(absl::StrCat("elements of type ", type));
  }

  /// Takes a line of data of the current block.
  absl::Status Take(absl::string_view line) {
    if (keyword_.name == "NODE") return TakeNode(line);
    if (keyword_.name == "ELEMENT" && kind_) return TakeElement(line);
    if (keyword_.name == "NSET") return TakeSet(line, keyword_.Of("NSET"), true);
    if (keyword_.name == "ELSET") return TakeSet(line, keyword_.Of("ELSET"), false);
    return absl::OkStatus();
  }

  absl::Status EndBlock() const {
    if (pending_.empty()) return absl::OkStatus();
    return lines_.Unreadable(absl::StrCat("element ", pending_[0], " has too few nodes"));
  }

  /// The words between commas, without the empty one after a comma at the end.
  static std::vector<absl::string_view> Fields(absl::string_view line) {
    std::vector<absl::string_view> fields;
    for (const absl::string_view field : absl::StrSplit(line, ',')) {
      fields.push_back(absl::StripAsciiWhitespace(field));
    }
    if (fields.back().empty()) fields.pop_back();
    return fields;
  }

  template <typename T>
  static std::optional<T> Number(absl::string_view field) {
    return ToNumber<T>(std::string_view(field.data(), field.size()));
  }

  absl::Status TakeNode(absl::string_view line) {
    const std::vector<absl::string_view> fields = Fields(line);
    const auto number = fields.empty() ? std::nullopt : Number<int64_t>(fields[0]);
    Point p{};
    bool ok = number.has_value() && fields.size() <= 7;  // normals may follow
    for (size_t x = 0; x < 3 && x + 1 < fields.size(); ++x) {
      const auto coordinate = Number<double>(fields[x + 1]);
      ok = ok && coordinate.has_value();
      p[x] = coordinate.value_or(0);
    }
    if (!ok) return lines_.Unreadable("no node (\"number, x, y, z\")");
    file_.node_numbers.push_back(*number);
    file_.nodes.push_back(p);
    AddNodeTo(keyword_.Of("NSET"), *number);
    return CheckNodeCountOfFile(file_.nodes.size());
  }

  /// The numbers of an element may go over several lines.
  absl::Status TakeElement(absl::string_view line) {
    for (const absl::string_view field : Fields(line)) {
      const auto number = Number<int64_t>(field);
      if (!number) return lines_.Unreadable("no element (\"number, nodes\")");
      pending_.push_back(*number);
    }
    if (pending_.size() < 1 + kind_->node_count) return absl::OkStatus();
    if (pending_.size() > 1 + kind_->node_count) {
      return lines_.Unreadable(absl::StrCat("element ", pending_[0], " has too many nodes"));
    }
    const std::vector<int64_t> element = std::exchange(pending_, {});
    return AddElement(element[0], {element.begin() + 1, element.end()});
  }

  absl::Status AddElement(int64_t number, const std::vector<int64_t>& nodes) {
    Placed placed{.corners = {nodes.begin(), nodes.begin() + ptrdiff_t(kind_->corner_count)},
                  .first_triangle = file_.triangles.size(),
                  .end_triangle = 0};
    if (kind_->dimension == 2) AddFace(nodes);
    placed.end_triangle = file_.triangles.size();
    AddElementTo(keyword_.Of("ELSET"), placed);
    elements_[number] = std::move(placed);
    return kind_->dimension == 3 ? file_.AddTetrahedron(nodes) : absl::OkStatus();
  }

  /// Adds a face as one, two or (with mid-side nodes) four triangles.
  void AddFace(const std::vector<int64_t>& n) {
    using Triangle = std::array<int64_t, 3>;
    std::vector<Triangle> pieces = {{n[0], n[1], n[2]}};
    if (kind_->corner_count == 4) pieces.push_back({n[0], n[2], n[3]});
    if (kind_->node_count == 6) {
      pieces = {{n[0], n[3], n[5]}, {n[3], n[1], n[4]}, {n[5], n[4], n[2]}, {n[3], n[4], n[5]}};
    }
    file_.AddTriangles({}, pieces);
  }

  /// Takes members of a set: numbers, names of other sets, or with GENERATE "first, last, step".
  absl::Status TakeSet(absl::string_view line, const std::string& name, bool of_nodes) {
    const std::vector<absl::string_view> fields = Fields(line);
    if (keyword_.Has("GENERATE")) return Generate(fields, name, of_nodes);
    for (const absl::string_view field : fields) {
      const auto number = Number<int64_t>(field);
      if (number) {
        AddMember(name, *number, of_nodes);
      } else {
        AddSet(name, field);
      }
    }
    return absl::OkStatus();
  }

  absl::Status Generate(const std::vector<absl::string_view>& fields, const std::string& name,
                        bool of_nodes) {
    std::array<int64_t, 3> range = {0, 0, 1};
    for (size_t i = 0; i < std::min(fields.size(), range.size()); ++i) {
      range[i] = Number<int64_t>(fields[i]).value_or(-1);
    }
    const auto& [first, last, step] = range;
    if (fields.size() < 2 || first < 0 || step < 1 || (last - first) / step > kMostMembers) {
      return lines_.Unreadable("no range of a set (\"first, last, step\")");
    }
    for (int64_t number = first; number <= last; number += step) AddMember(name, number, of_nodes);
    return absl::OkStatus();
  }

  void AddMember(const std::string& name, int64_t number, bool of_nodes) {
    if (of_nodes) return AddNodeTo(name, number);
    const auto element = elements_.find(number);
    if (element != elements_.end()) AddElementTo(name, element->second);
  }

  void AddSet(const std::string& name, absl::string_view other) {
    const auto found = Find(std::string(other));
    if (found == file_.groups.end() || absl::EqualsIgnoreCase(name, other)) return;
    const ElementFile::Group members = *found;
    ElementFile::Group& group = Named(name);
    group.simplices.insert(group.simplices.end(), members.simplices.begin(),
                           members.simplices.end());
    group.triangles.insert(group.triangles.end(), members.triangles.begin(),
                           members.triangles.end());
  }

  void AddNodeTo(const std::string& name, int64_t number) {
    if (name.empty()) return;
    auto& simplex = Named(name).simplices.emplace_back();
    simplex.fill(ElementFile::kNoNode);
    simplex[0] = number;
  }

  void AddElementTo(const std::string& name, const Placed& element) {
    if (name.empty()) return;
    ElementFile::Group& group = Named(name);
    auto& simplex = group.simplices.emplace_back();
    simplex.fill(ElementFile::kNoNode);
    std::ranges::copy(element.corners, simplex.begin());
    for (size_t t = element.first_triangle; t < element.end_triangle; ++t) {
      group.triangles.push_back(static_cast<int32_t>(t));
    }
  }

  /// Names differ in more than the case of their letters.
  std::vector<ElementFile::Group>::iterator Find(const std::string& name) {
    return std::ranges::find_if(file_.groups, [&](const ElementFile::Group& group) {
      return absl::EqualsIgnoreCase(group.name, name);
    });
  }

  ElementFile::Group& Named(const std::string& name) {
    const auto found = Find(name);
    if (found != file_.groups.end()) return *found;
    return file_.groups.emplace_back(
        ElementFile::Group{.name = name, .simplices = {}, .triangles = {}});
  }

  static constexpr int64_t kMostMembers = 10'000'000;

  TextLines lines_;
  ElementFile file_;
  Keyword keyword_;
  std::optional<InpKind> kind_;   // the kind of the elements that are being read
  std::vector<int64_t> pending_;  // the number and the first nodes of an element
  absl::flat_hash_map<int64_t, Placed> elements_;
  int part_count_ = 0;
};

}  // namespace

absl::StatusOr<ElementFile> ParseInp(const std::string& bytes) { return InpParser(bytes).Parse(); }

}  // namespace carillon::precompute
