// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/inp_file.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "precompute/mesh/read/elements/inp_kind.h"
#include "precompute/mesh/read/elements/inp_lines.h"
#include "precompute/mesh/read/elements/inp_model.h"
#include "precompute/mesh/read/elements/inp_motion.h"
#include "precompute/mesh/read/text/text_lines.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Keywords that make, move, add or take away parts of the body in ways that are not read.
constexpr std::string_view kInpRefused[] = {"NGEN",
                                            "NFILL",
                                            "NCOPY",
                                            "NMAP",
                                            "ELGEN",
                                            "ELCOPY",
                                            "IMPERFECTION",
                                            "IMPORT",
                                            "SYMMETRIC MODEL GENERATION",
                                            "CYCLIC SYMMETRY MODEL",
                                            "NONSTRUCTURAL MASS",
                                            "MASS",
                                            "ROTARY INERTIA",
                                            "MODEL CHANGE",
                                            "PARAMETER"};
/// A material of the file, with the lines that state its elasticity and density.
struct StatedMaterial {
  std::string name;
  std::vector<std::string> figures;
};

/// Conditions that change how the body vibrates, and that the settings of a model give instead.
constexpr std::string_view kInpConditions[] = {"BOUNDARY", "EQUATION",   "MPC",
                                               "COUPLING", "RIGID BODY", "TIE"};

class InpParser {
 public:
  explicit InpParser(const std::string& bytes) : lines_(bytes) {}

  absl::StatusOr<ElementFile> Parse() && {
    std::string_view line;
    while (lines_.Next(line)) {
      const size_t begin = line.find_first_not_of(" \t");
      if (begin == std::string_view::npos) continue;
      if (line.substr(begin).starts_with("**")) {
        TakeComment(line);
        continue;
      }
      RETURN_IF_ERROR(line[begin] == '*' ? Begin(line.substr(begin)) : Take(line.substr(begin)));
    }
    RETURN_IF_ERROR(EndBlock());
    std::vector<InpBody> bodies = TakeBodies();
    for (InpBody& body : bodies) WarnOfSolidSections(body.scope);
    WarnOfMaterials();
    ASSIGN_OR_RETURN(ElementFile file, JoinBodies(std::move(bodies), assembly_sets_));
    file.warnings = std::move(warnings_);
    return file;
  }

 private:
  /// ReadMeshFile puts "**@ LINE FILE" before lines of another file.
  void TakeComment(std::string_view line) {
    if (!line.starts_with("**@ ")) return;
    line.remove_prefix(4);
    const size_t blank = std::min(line.find(' '), line.size());
    const auto number = ToNumber<int>(line.substr(0, blank));
    if (number) lines_.GoOnAt(*number, line.substr(std::min(blank + 1, line.size())));
  }

  /// Begins the block of a keyword line, which goes on in the next line after a comma at its end.
  absl::Status Begin(std::string_view line) {
    RETURN_IF_ERROR(EndBlock());
    std::string joined(line);
    std::string_view more;
    const auto trim = [&] { joined.erase(joined.find_last_not_of(" \t\r") + 1); };
    for (trim(); joined.ends_with(',') && lines_.Next(more); trim()) joined += more;
    keyword_ = ParseInpKeyword(joined);
    data_lines_ = 0;
    if (std::ranges::find(kInpRefused, keyword_.name) != std::end(kInpRefused)) {
      return NotRead(absl::StrCat("*", keyword_.name));
    }
    const bool is_mesh = keyword_.name == "NODE" || keyword_.name == "ELEMENT" ||
                         keyword_.name == "NSET" || keyword_.name == "ELSET";
    if (keyword_.name == "INCLUDE" || (is_mesh && keyword_.Has("INPUT"))) {
      return lines_.Unreadable(absl::StrCat(
          "the file ", QuotedText(keyword_.Of("INPUT")),
          " belongs here, and did not come with this one: give Carillon's programs or clients the "
          "path of the .inp file, which brings the files in its folder"));
    }
    if (is_mesh && keyword_.Has("FILE")) return NotRead("FILE=");
    WarnOfCondition();
    if (keyword_.name == "NSET" && keyword_.Has("ELSET")) TakeNodesOfElements();
    if (keyword_.name == "PART" || keyword_.name == "INSTANCE" || keyword_.name == "ASSEMBLY" ||
        keyword_.name.starts_with("END ")) {
      return ChangeScope();
    }
    if (keyword_.name == "SYSTEM") system_ = {};
    if (keyword_.name == "NODE") return BeginNodes();
    if (keyword_.name == "ELEMENT") return BeginElements();
    if (keyword_.name == "SOLID SECTION") return TakeSection();
    if (keyword_.name == "MATERIAL") materials_.push_back({keyword_.Of("NAME"), {}});
    if (keyword_.name.ends_with(" SECTION")) WarnOfSection();
    return absl::OkStatus();
  }

  absl::Status NotRead(absl::string_view what) const {
    return lines_.Unreadable(
        absl::StrCat("it has ", what,
                     ", which is not read; only files with all nodes and elements of the body "
                     "written out are"));
  }

  void WarnOfCondition() {
    if (std::ranges::find(kInpConditions, keyword_.name) == std::end(kInpConditions)) return;
    const std::string warning = absl::StrCat("*", keyword_.name, " of the file (", lines_.place(),
                                             ") is not used; --fix fixes a body");
    if (warned_.insert(keyword_.name).second) warnings_.push_back(warning);
  }

  /// Sections of shells and the like give a thickness, which no body here has.
  void WarnOfSection() {
    if (!warned_.insert(keyword_.name).second) return;
    warnings_.push_back(absl::StrCat("*", keyword_.name, " of the file (", lines_.place(),
                                     ") is not used: the faces only bound a solid body; --wall "
                                     "makes a closed surface hollow"));
  }

  /// The request gives the materials, because a file states no loss factors, and figures in units
  /// that it does not name.
  void WarnOfMaterials() {
    for (const auto& [name, figures] : materials_) {
      if (figures.empty()) continue;
      warnings_.push_back(absl::StrCat("the figures of the file's material ", QuotedText(name),
                                       " (", absl::StrJoin(figures, "; "),
                                       ") are not used, but those of the given material"));
    }
  }

  void WarnOfSolidSections(InpScope& scope) {
    for (const MeshRegion& section : scope.sections) {
      const InpScope::Set* set = scope.FindSet(section.name);
      const bool has_trusses =
          set != nullptr && std::ranges::any_of(set->elements, [&](const InpMember& member) {
            const auto element = scope.element_at.find(member.element);
            return element != scope.element_at.end() &&
                   scope.elements[element->second].kind.dimension == 1;
          });
      if (set != nullptr && !has_trusses) continue;
      warnings_.push_back(absl::StrCat("the section of the set ", QuotedText(section.name),
                                       " is not used, because the set ",
                                       has_trusses ? "has trusses" : "is not there"));
    }
  }

  /// *PART, *ASSEMBLY and *INSTANCE, and their ends.
  absl::Status ChangeScope() {
    system_ = {};
    if (keyword_.name == "PART") {
      scope_ = &parts_[InpName(keyword_.Of("NAME"))];
    } else if (keyword_.name == "INSTANCE") {
      if (keyword_.Has("LIBRARY") || keyword_.Has("INSTANCE")) {
        return NotRead("an *INSTANCE of another analysis");
      }
      const auto part = parts_.find(InpName(keyword_.Of("PART")));
      if (part == parts_.end()) {
        return lines_.Unreadable(absl::StrCat(
            "an instance of the part ", QuotedText(keyword_.Of("PART")), ", which is not there"));
      }
      instances_.push_back(std::make_unique<InpBody>(InpBody{keyword_.Of("NAME"), part->second}));
      scope_ = &instances_.back()->scope;
    } else if (keyword_.name == "ASSEMBLY" || keyword_.name == "END INSTANCE") {
      scope_ = &assembly_;
    } else if (keyword_.name == "END PART" || keyword_.name == "END ASSEMBLY") {
      scope_ = &model_;
    }
    return absl::OkStatus();
  }

  absl::Status BeginNodes() {
    const std::string system = InpName(keyword_.Of("SYSTEM"));
    is_cylindrical_ = system.starts_with('C');
    if (system.empty() || system.starts_with('R') || is_cylindrical_) return absl::OkStatus();
    return NotRead(absl::StrCat("*NODE, SYSTEM=", EscapedText(system.substr(0, 60))));
  }

  absl::Status BeginElements() {
    const std::string type = InpName(keyword_.Of("TYPE"));
    kind_ = FindInpKind(type);
    if (kind_) return absl::OkStatus();
    return UnsupportedElements(absl::StrCat("elements of type ", EscapedText(type.substr(0, 60)),
                                            " (", lines_.place(), ")"));
  }

  absl::Status TakeSection() {
    if (keyword_.Has("COMPOSITE")) return NotRead("*SOLID SECTION, COMPOSITE");
    scope_->sections.push_back({keyword_.Of("ELSET"), keyword_.Of("MATERIAL")});
    return absl::OkStatus();
  }

  /// Takes a line of data of the current block.
  absl::Status Take(std::string_view line) {
    ++data_lines_;
    if (keyword_.name.empty()) {
      return lines_.Unreadable(
          "data before the first keyword, so that it is no input of Abaqus or "
          "CalculiX");
    }
    const std::vector<std::string_view> fields = InpFields(line);
    if (keyword_.name == "NODE") return TakeNode(fields);
    if (keyword_.name == "ELEMENT" && kind_) return TakeElement(fields);
    if (keyword_.name == "NSET") return TakeSet(fields, keyword_.Of("NSET"), true);
    if (keyword_.name == "ELSET") return TakeSet(fields, keyword_.Of("ELSET"), false);
    if (keyword_.name == "SURFACE" && !fields.empty()) return TakeSurface(fields);
    if (keyword_.name == "INSTANCE") return TakePlace(fields);
    if (keyword_.name == "SYSTEM") return TakeSystem(fields);
    TakeFigures(fields);
    return absl::OkStatus();
  }

  /// The first line of a material's elasticity or density, as the file writes it.
  void TakeFigures(const std::vector<std::string_view>& fields) {
    const bool is_figure = keyword_.name == "ELASTIC" || keyword_.name == "DENSITY";
    if (!is_figure || data_lines_ > 1 || materials_.empty()) return;
    std::string figures = absl::StrCat("*", keyword_.name);
    if (keyword_.Has("TYPE")) absl::StrAppend(&figures, ", TYPE=", keyword_.Of("TYPE"));
    for (size_t i = 0; i < fields.size(); ++i) figures.append(i > 0 ? ", " : " ").append(fields[i]);
    materials_.back().figures.push_back(EscapedText(figures.substr(0, 90)));
  }

  absl::Status EndBlock() const {
    if (pending_.empty()) return absl::OkStatus();
    return lines_.Unreadable(absl::StrCat("element ", pending_[0], " has too few nodes"));
  }

  absl::StatusOr<std::vector<double>> Reals(const std::vector<std::string_view>& fields,
                                            size_t first) const {
    std::vector<double> values;
    for (size_t i = first; i < fields.size(); ++i) {
      const std::optional<double> value = InpReal(fields[i]);
      if (!value) return lines_.Unreadable(absl::StrCat(QuotedText(fields[i]), " is no number"));
      values.push_back(*value);
    }
    return values;
  }

  /// The lines of an instance: a translation, then the axis (two points) and angle of a rotation.
  absl::Status TakePlace(const std::vector<std::string_view>& fields) {
    ASSIGN_OR_RETURN(std::vector<double> v, Reals(fields, 0));
    InpMotion& motion = instances_.back()->motion;
    if (data_lines_ == 1 && v.size() <= 3) {
      v.resize(3);
      motion.shift = {v[0], v[1], v[2]};
      return absl::OkStatus();
    }
    const Point a = {v[0], v.size() > 1 ? v[1] : 0, v.size() > 2 ? v[2] : 0};
    v.resize(7);
    const Point b = {v[3], v[4], v[5]};
    if (data_lines_ > 2 || fields.size() > 7 || a == b) {
      return lines_.Unreadable(
          "no place of an instance (\"x, y, z\", then two points of an axis and an angle)");
    }
    motion.Turn(a, b, v[6]);
    return absl::OkStatus();
  }

  absl::Status TakeSystem(const std::vector<std::string_view>& fields) {
    ASSIGN_OR_RETURN(const std::vector<double> values, Reals(fields, 0));
    if (system_.TakeLine(values, data_lines_)) return absl::OkStatus();
    return lines_.Unreadable("no points of *SYSTEM, or they lie on one line");
  }

  absl::Status TakeNode(const std::vector<std::string_view>& fields) {
    const auto number = fields.empty() ? std::nullopt : ToNumber<int64_t>(fields[0]);
    const absl::StatusOr<std::vector<double>> values = Reals(fields, 1);
    if (!number || fields.size() > 7 || !values.ok()) {  // normals may follow
      return lines_.Unreadable("no node (\"number, x, y, z\")");
    }
    Point p{};
    for (size_t x = 0; x < std::min<size_t>(3, values->size()); ++x) p[x] = (*values)[x];
    p = system_.Apply(is_cylindrical_ ? FromCylindrical(p) : p);
    if (!keyword_.Of("NSET").empty())
      scope_->SetNamed(keyword_.Of("NSET")).nodes.push_back(*number);
    const auto [found, is_new] = scope_->node_at.try_emplace(*number, scope_->points.size());
    if (!is_new && scope_->points[found->second] != p) {
      return lines_.Unreadable(
          absl::StrCat("node ", *number, " is there twice, at different places"));
    }
    if (!is_new) return absl::OkStatus();
    scope_->node_numbers.push_back(*number);
    scope_->points.push_back(p);
    return CheckNodeCountOfFile(scope_->points.size());
  }

  /// The numbers of an element may go over several lines.
  absl::Status TakeElement(const std::vector<std::string_view>& fields) {
    for (const std::string_view field : fields) {
      const auto number = ToNumber<int64_t>(field);
      if (!number) return lines_.Unreadable("no element (\"number, nodes\")");
      pending_.push_back(*number);
    }
    if (pending_.size() < 1 + kind_->node_count) return absl::OkStatus();
    if (pending_.size() > 1 + kind_->node_count) {
      return lines_.Unreadable(absl::StrCat("element ", pending_[0], " has too many nodes"));
    }
    const std::vector<int64_t> element = std::exchange(pending_, {});
    const int64_t number = element[0];
    if (!keyword_.Of("ELSET").empty()) {
      scope_->SetNamed(keyword_.Of("ELSET")).elements.push_back({number});
    }
    const auto [found, is_new] = scope_->element_at.try_emplace(number, scope_->elements.size());
    if (!is_new) {
      const InpScope::Element& first = scope_->elements[found->second];
      const auto nodes = scope_->element_nodes.begin() + static_cast<ptrdiff_t>(first.first_node);
      if (first.kind.node_count == kind_->node_count &&
          std::equal(element.begin() + 1, element.end(), nodes)) {
        return absl::OkStatus();
      }
      return lines_.Unreadable(
          absl::StrCat("element ", number, " is there twice, with different nodes"));
    }
    scope_->elements.push_back({number, *kind_, scope_->element_nodes.size()});
    scope_->element_nodes.insert(scope_->element_nodes.end(), element.begin() + 1, element.end());
    return absl::OkStatus();
  }

  /// Takes members of a set: numbers, names of other sets, or with GENERATE "first, last, step".
  absl::Status TakeSet(const std::vector<std::string_view>& fields, const std::string& name,
                       bool of_nodes) {
    if (keyword_.Has("GENERATE")) return Generate(fields, name, of_nodes);
    for (const std::string_view field : fields) {
      const auto number = ToNumber<int64_t>(field);
      if (number) {
        AddMember(name, *number, of_nodes);
      } else {
        AddSet(name, std::string(field), of_nodes);
      }
    }
    return absl::OkStatus();
  }

  /// "*NSET, NSET=nodes, ELSET=elements"
  void TakeNodesOfElements() {
    const InpScope::Set* found = scope_->FindSet(keyword_.Of("ELSET"));
    if (found == nullptr) return WarnOfMissing(keyword_.Of("ELSET"), keyword_.Of("NSET"));
    const std::vector<int64_t> numbers = NumbersOf(*found, false);
    InpScope::Set& set = scope_->SetNamed(keyword_.Of("NSET"));
    for (const int64_t number : numbers) {
      const auto at = scope_->element_at.find(number);
      if (at == scope_->element_at.end()) continue;
      const InpScope::Element& element = scope_->elements[at->second];
      const auto first = scope_->element_nodes.begin() + static_cast<ptrdiff_t>(element.first_node);
      set.nodes.insert(set.nodes.end(), first,
                       first + static_cast<ptrdiff_t>(element.kind.node_count));
    }
  }

  /// "set or node" of a surface of nodes, and "set or element, S2" of a surface of faces. A surface
  /// is a group, as a set is.
  absl::Status TakeSurface(const std::vector<std::string_view>& fields) {
    const std::string name = keyword_.Of("NAME");
    if (InpName(keyword_.Of("TYPE")) == "NODE") return TakeSet({fields[0]}, name, true);
    const std::string face = fields.size() > 1 ? InpName(fields[1]) : "";
    const bool is_numbered = face.size() == 2 && face[0] == 'S' && face[1] >= '1' && face[1] <= '4';
    if (!is_numbered && face != "SPOS" && face != "SNEG") {
      if (warned_.insert("SURFACE " + name).second) {
        warnings_.push_back(absl::StrCat(
            lines_.place(), ": the surface ", QuotedText(name),
            " is no group, because a row does not name its faces (S1 to S4, SPOS or SNEG)"));
      }
      return absl::OkStatus();
    }
    face_ = is_numbered ? face[1] - '0' : 0;
    absl::Status status = TakeSet({fields[0]}, name, false);
    face_ = 0;
    return status;
  }

  absl::Status Generate(const std::vector<std::string_view>& fields, const std::string& name,
                        bool of_nodes) {
    std::array<int64_t, 3> range = {0, 0, 1};
    for (size_t i = 0; i < std::min(fields.size(), range.size()); ++i) {
      range[i] = ToNumber<int64_t>(fields[i]).value_or(-1);
    }
    const auto& [first, last, step] = range;
    if (fields.size() < 2 || first < 0 || step < 1 || (last - first) / step > kMostMembers) {
      return lines_.Unreadable("no range of a set (\"first, last, step\")");
    }
    for (int64_t number = first; number <= last; number += step) AddMember(name, number, of_nodes);
    return absl::OkStatus();
  }

  void AddMember(const std::string& name, int64_t number, bool of_nodes) {
    if (keyword_.Has("INSTANCE"))
      return AddMemberOf(keyword_.Of("INSTANCE"), name, number, of_nodes);
    Put(number, of_nodes, scope_->SetNamed(name));
  }

  void AddMemberOf(const std::string& instance, const std::string& name, int64_t number,
                   bool of_nodes) {
    const auto is_same = [&](const InpAssemblySet& set) {
      return absl::EqualsIgnoreCase(set.name, name) &&
             absl::EqualsIgnoreCase(set.instance, instance);
    };
    auto set = std::ranges::find_if(assembly_sets_, is_same);
    if (set == assembly_sets_.end()) {
      set = assembly_sets_.insert(set, InpAssemblySet{name, instance, {}, {}});
    }
    Put(number, of_nodes, *set);
  }

  template <typename Set>
  void Put(int64_t number, bool of_nodes, Set& set) const {
    if (of_nodes) {
      set.nodes.push_back(number);
    } else {
      set.elements.push_back({number, face_});
    }
  }

  static std::vector<int64_t> NumbersOf(const auto& set, bool of_nodes) {
    if (of_nodes) return set.nodes;
    std::vector<int64_t> numbers;
    numbers.reserve(set.elements.size());
    for (const InpMember& member : set.elements) numbers.push_back(member.element);
    return numbers;
  }

  /// Adds the members of another set, or in an assembly "INSTANCE.NUMBER" or "INSTANCE.SET".
  void AddSet(const std::string& name, const std::string& other, bool of_nodes) {
    InpScope* scope = scope_;
    std::string instance = keyword_.Of("INSTANCE"), rest = other;
    if (const size_t dot = other.rfind('.'); dot != std::string::npos && instance.empty()) {
      instance = other.substr(0, dot);
      rest = other.substr(dot + 1);
    }
    if (!instance.empty()) {
      const auto body = std::ranges::find_if(
          instances_, [&](const auto& b) { return absl::EqualsIgnoreCase(b->name, instance); });
      scope = body == instances_.end() ? nullptr : &(*body)->scope;
      const auto number = ToNumber<int64_t>(rest);
      if (scope != nullptr && number) return AddMemberOf(instance, name, *number, of_nodes);
    }
    const InpScope::Set* found = scope == nullptr ? nullptr : scope->FindSet(rest);
    if (found == nullptr) return AddAssemblySets(name, other, of_nodes);
    if (instance.empty() && absl::EqualsIgnoreCase(name, other)) return;
    for (const int64_t n : NumbersOf(*found, of_nodes)) {
      if (instance.empty()) {
        AddMember(name, n, of_nodes);
      } else {
        AddMemberOf(instance, name, n, of_nodes);
      }
    }
  }

  /// Adds the members of a set of the assembly, which may be in several instances.
  void AddAssemblySets(const std::string& name, const std::string& other, bool of_nodes) {
    bool is_found = false;
    for (const InpAssemblySet& set : std::vector<InpAssemblySet>(assembly_sets_)) {
      if (!absl::EqualsIgnoreCase(set.name, other)) continue;
      is_found = true;
      for (const int64_t n : NumbersOf(set, of_nodes)) {
        AddMemberOf(set.instance, name, n, of_nodes);
      }
    }
    if (!is_found) WarnOfMissing(other, name);
  }

  void WarnOfMissing(const std::string& other, const std::string& name) {
    warnings_.push_back(absl::StrCat(lines_.place(), ": the set ", QuotedText(other),
                                     " is not there, and was left out of ", QuotedText(name)));
  }

  /// The instances; where there are none, the only part, or what stands outside all parts.
  std::vector<InpBody> TakeBodies() {
    std::vector<InpBody> bodies;
    for (const auto& instance : instances_) bodies.push_back(std::move(*instance));
    if (bodies.empty()) {
      for (auto& [name, part] : parts_) bodies.push_back({name, std::move(part)});
    }
    if (bodies.empty() || !model_.elements.empty()) bodies.push_back({"", std::move(model_)});
    return bodies;
  }

  static constexpr int64_t kMostMembers = 10'000'000;

  TextLines lines_;
  InpScope model_, assembly_;
  std::map<std::string, InpScope> parts_;
  std::vector<std::unique_ptr<InpBody>> instances_;
  std::vector<InpAssemblySet> assembly_sets_;
  std::vector<StatedMaterial> materials_;
  InpScope* scope_ = &model_;  // to which the lines belong that are being read
  InpKeyword keyword_;
  int data_lines_ = 0;            // of the current block so far
  std::optional<InpKind> kind_;   // the kind of the elements that are being read
  std::vector<int64_t> pending_;  // the number and the first nodes of an element
  bool is_cylindrical_ = false;   // how the nodes are given that are being read
  InpSystem system_;              // and in which system
  int face_ = 0;                  // the face of the elements of a surface that is being read
  std::set<std::string> warned_;
  std::vector<std::string> warnings_;
};

}  // namespace

absl::StatusOr<ElementFile> ParseInp(const std::string& bytes) { return InpParser(bytes).Parse(); }

}  // namespace carillon::precompute
