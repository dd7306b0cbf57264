// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/inp_model.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "precompute/mesh/read/elements/inp_lines.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Numbers of nodes of several bodies are this far apart.
constexpr int64_t kBodyStride = int64_t{1} << 40;

/// The corners of the faces S1 to S4 of a tetrahedron.
constexpr std::array<std::array<size_t, 3>, 4> kInpFaces = {
    {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};

/// Adds the bodies to a file one after the other.
class BodyJoiner {
 public:
  explicit BodyJoiner(const std::vector<InpBody>& bodies) : bodies_(bodies) {
    size_t solid_count = 0;
    for (size_t b = 0; b < bodies.size(); ++b) {
      for (const InpScope::Set& set : bodies[b].scope.sets) ++owners_[InpName(set.name)];
      const bool is_solid = std::ranges::any_of(bodies[b].scope.elements, [](const auto& element) {
        return element.kind.dimension == 3;
      });
      if (is_solid && solid_count++ == 0) numbered_ = b;
    }
    keeps_numbers_ = bodies.size() == 1 || solid_count == 1;
  }

  absl::StatusOr<ElementFile> Join(const std::vector<InpAssemblySet>& sets) && {
    for (const InpAssemblySet& set : sets) is_of_assembly_.insert(InpName(set.name));
    for (size_t b = 0; b < bodies_.size(); ++b) {
      RETURN_IF_ERROR(AddBody(b));
    }
    for (const InpAssemblySet& set : sets) AddAssemblySet(set);
    return std::move(file_);
  }

 private:
  /// The triangles of a face, or the whole element.
  struct Placed {
    size_t first_triangle;
    size_t end_triangle;
  };

  int64_t NumberOf(size_t b, int64_t number) const {
    const bool keeps_number = keeps_numbers_ && b == numbered_;
    return keeps_number ? number : number + (static_cast<int64_t>(b) + 1) * kBodyStride;
  }

  absl::Status AddBody(size_t b) {
    const InpBody& body = bodies_[b];
    for (size_t n = 0; n < body.scope.points.size(); ++n) {
      file_.node_numbers.push_back(NumberOf(b, body.scope.node_numbers[n]));
      file_.nodes.push_back(body.motion.Apply(body.scope.points[n]));
    }
    std::vector<Placed>& placed = placed_.emplace_back();
    const std::vector<MeshRegion> sections = body.scope.SectionsOfElements();
    for (size_t e = 0; e < sections.size(); ++e) {
      ASSIGN_OR_RETURN(Placed one, AddElement(b, body.scope.elements[e], sections[e]));
      placed.push_back(one);
    }
    for (const InpScope::Set& set : body.scope.sets) {
      const std::string key = InpName(set.name);
      const bool is_alone = owners_.at(key) == 1 && !is_of_assembly_.contains(key);
      AddMembers(b,
                 is_alone || body.name.empty() ? set.name : absl::StrCat(body.name, ".", set.name),
                 set.nodes, set.elements);
    }
    return absl::OkStatus();
  }

  std::span<const int64_t> NodesOf(size_t b, const InpScope::Element& element) const {
    return std::span(bodies_[b].scope.element_nodes)
        .subspan(element.first_node, element.kind.node_count);
  }

  absl::StatusOr<Placed> AddElement(size_t b, const InpScope::Element& element,
                                    const MeshRegion& section) {
    std::vector<int64_t> nodes;
    for (const int64_t number : NodesOf(b, element)) {
      if (!bodies_[b].scope.node_at.contains(number)) {
        return Refusal(
            absl::StatusCode::kInvalidArgument, "MESH_INDEX_OUT_OF_RANGE",
            absl::StrCat(
                "element ", element.number,
                bodies_[b].name.empty() ? "" : absl::StrCat(" of ", QuotedText(bodies_[b].name)),
                " names node ", number, ", which is not there: export the mesh again"));
      }
      nodes.push_back(NumberOf(b, number));
    }
    const size_t first = file_.triangles.size();
    if (element.kind.dimension == 2) AddFace(element.kind, nodes);
    if (element.kind.dimension == 3) {
      RETURN_IF_ERROR(file_.AddTetrahedron(nodes, section));
    }
    return Placed{first, file_.triangles.size()};
  }

  /// Adds a face as one, two or (with mid-side nodes) four triangles.
  void AddFace(const InpKind& kind, const std::vector<int64_t>& n) {
    using Triangle = std::array<int64_t, 3>;
    std::vector<Triangle> pieces = {{n[0], n[1], n[2]}};
    if (kind.corner_count == 4) pieces.push_back({n[0], n[2], n[3]});
    if (kind.node_count == 6) {
      pieces.clear();
      pieces.reserve(kFaceInFour.size());
      for (const auto& [a, b, c] : kFaceInFour) pieces.push_back({n[a], n[b], n[c]});
    }
    file_.AddTriangles({}, pieces);
  }

  void AddMembers(size_t b, const std::string& name, const std::vector<int64_t>& nodes,
                  const std::vector<InpMember>& elements) {
    ElementFile::Group& group = file_.Named(name);
    const auto add = [&](std::span<const int64_t> corners) {
      auto& simplex = group.simplices.emplace_back();
      simplex.fill(ElementFile::kNoNode);
      std::ranges::transform(corners, simplex.begin(),
                             [&](int64_t number) { return NumberOf(b, number); });
    };
    const InpScope& scope = bodies_[b].scope;
    for (const int64_t number : nodes) add(std::span(&number, 1));
    for (const auto& [number, face] : elements) {
      const auto found = scope.element_at.find(number);
      if (found == scope.element_at.end()) continue;
      const InpScope::Element& element = scope.elements[found->second];
      const std::span<const int64_t> nodes_of_one = NodesOf(b, element);
      if (face > 0 && element.kind.dimension == 3) {
        const auto& [i, j, k] = kInpFaces[static_cast<size_t>(face) - 1];
        add(std::array{nodes_of_one[i], nodes_of_one[j], nodes_of_one[k]});
        continue;
      }
      add(nodes_of_one.first(element.kind.corner_count));
      const Placed& placed = placed_[b][found->second];
      for (size_t t = placed.first_triangle; t < placed.end_triangle; ++t) {
        group.triangles.push_back(static_cast<int32_t>(t));
      }
    }
  }

  void AddAssemblySet(const InpAssemblySet& set) {
    for (size_t b = 0; b < bodies_.size(); ++b) {
      if (!absl::EqualsIgnoreCase(bodies_[b].name, set.instance)) continue;
      AddMembers(b, set.name, set.nodes, set.elements);
    }
  }

  const std::vector<InpBody>& bodies_;
  bool keeps_numbers_ = false;         // whether one body's nodes keep their numbers:
  size_t numbered_ = 0;                // the only one, or the only one with tetrahedra
  std::map<std::string, int> owners_;  // number of bodies with a set of that name
  std::set<std::string> is_of_assembly_;
  std::vector<std::vector<Placed>> placed_;
  ElementFile file_;
};

}  // namespace

InpScope::Set* InpScope::FindSet(const std::string& name) {
  const auto found = std::ranges::find_if(
      sets, [&](const Set& set) { return absl::EqualsIgnoreCase(set.name, name); });
  return found == sets.end() ? nullptr : &*found;
}

InpScope::Set& InpScope::SetNamed(const std::string& name) {
  Set* found = FindSet(name);
  return found != nullptr ? *found
                          : sets.emplace_back(Set{.name = name, .nodes = {}, .elements = {}});
}

std::vector<MeshRegion> InpScope::SectionsOfElements() const {
  std::vector<MeshRegion> of_elements(elements.size());
  for (const MeshRegion& section : sections) {
    const auto set = std::ranges::find_if(
        sets, [&](const Set& named) { return absl::EqualsIgnoreCase(named.name, section.name); });
    if (set == sets.end()) continue;
    for (const InpMember& member : set->elements) {
      const auto element = element_at.find(member.element);
      if (element != element_at.end()) of_elements[element->second] = section;
    }
  }
  return of_elements;
}

absl::StatusOr<ElementFile> JoinBodies(std::vector<InpBody> bodies,
                                       const std::vector<InpAssemblySet>& sets) {
  // Bodies without elements are reference points.
  if (bodies.size() > 1) {
    std::erase_if(bodies, [](const InpBody& body) { return body.scope.elements.empty(); });
  }
  return BodyJoiner(bodies).Join(sets);
}

}  // namespace carillon::precompute
