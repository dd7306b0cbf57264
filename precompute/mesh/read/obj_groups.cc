// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/obj_groups.h"

#include <algorithm>
#include <string_view>

#include "precompute/mesh/read/text_lines.h"

namespace carillon::precompute {
namespace {

using LineWords = std::vector<std::string_view>;

/// The groups of the following faces, and all groups seen so far.
class Groups {
 public:
  /// "g one two": a face may be in several groups.
  void EnterGroups(const LineWords& words) {
    in_groups_.clear();
    for (size_t i = 1; i < words.size(); ++i) in_groups_.push_back(Find(words[i]));
  }

  void EnterObject(const LineWords& words) {
    in_object_.clear();
    if (words.size() > 1) in_object_.push_back(Find(words[1]));
  }

  /// Adds a polygon of `corner_count` corners, which is split into triangles.
  void AddFace(size_t corner_count) {
    if (corner_count < 3) return;
    for (size_t i = 2; i < corner_count; ++i, ++next_triangle_) {
      for (const size_t g : in_groups_) Add(g);
      for (const size_t g : in_object_) Add(g);
    }
  }

  std::vector<MeshGroup> Take() && { return std::move(groups_); }

 private:
  size_t Find(std::string_view name) {
    const auto found = std::ranges::find(groups_, name, &MeshGroup::name);
    if (found != groups_.end()) return static_cast<size_t>(found - groups_.begin());
    groups_.push_back({.name = std::string(name)});
    return groups_.size() - 1;
  }

  void Add(size_t group) {
    std::vector<int32_t>& triangles = groups_[group].triangles;
    if (triangles.empty() || triangles.back() != next_triangle_)
      triangles.push_back(next_triangle_);
  }

  std::vector<MeshGroup> groups_;
  std::vector<size_t> in_groups_, in_object_;
  int32_t next_triangle_ = 0;
};

}  // namespace

std::vector<MeshGroup> ObjGroups(const std::string& bytes) {
  Groups groups;
  std::string line;
  for (TextLines lines(bytes); NextObjLine(lines, line);) {
    const LineWords words = TextLines::Words(std::string_view(line).substr(0, line.find('#')));
    if (words.empty()) continue;
    if (words[0] == "g") groups.EnterGroups(words);
    if (words[0] == "o") groups.EnterObject(words);
    if (words[0] == "f") groups.AddFace(words.size() - 1);
  }
  return std::move(groups).Take();
}

}  // namespace carillon::precompute
