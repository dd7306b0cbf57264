// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/gmsh41_sections.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

absl::Status Malformed(absl::string_view section) {
  return Refusal(absl::StatusCode::kInvalidArgument, "MESH_UNREADABLE",
                 absl::StrCat("the file cannot be read as Gmsh MSH 4.1: its ", section,
                              " end too early, or one is not as the format has it. Export the mesh "
                              "again, by \"gmsh -format msh41\""));
}

/// Adds `count` numbers to `values`. Memory grows only with the numbers actually in the file.
template <typename T>
bool TakeMany(uint64_t count, NumberStream& stream, std::vector<T>& values) {
  for (uint64_t i = 0; i < count; ++i) {
    T value{};
    if (!stream.Take(value)) return false;
    values.push_back(value);
  }
  return true;
}

}  // namespace

absl::Status Gmsh41Sections::ReadEntities(NumberStream& stream) {
  return ReadAllEntities(false, stream);
}

/// The numbers of partitions and of ghost entities, the number and partition of each of these, and
/// the parts of entities to which the elements of a partitioned mesh belong.
absl::Status Gmsh41Sections::ReadPartitionedEntities(NumberStream& stream) {
  std::array<uint64_t, 2> counts{};
  std::vector<int32_t> ghosts;
  if (!stream.TakeAll(counts) || !TakeMany(counts[1], stream, ghosts) ||
      !TakeMany(counts[1], stream, ghosts)) {
    return Malformed("partitioned entities");
  }
  return ReadAllEntities(true, stream);
}

absl::Status Gmsh41Sections::ReadAllEntities(bool partitioned, NumberStream& stream) {
  std::array<uint64_t, 4> counts{};
  if (!stream.TakeAll(counts)) return Malformed("entities");
  for (int dimension = 0; dimension < 4; ++dimension) {
    for (uint64_t i = 0; i < counts[static_cast<size_t>(dimension)]; ++i) {
      if (!ReadEntity(dimension, partitioned, stream)) return Malformed("entities");
    }
  }
  return absl::OkStatus();
}

/// An entity: its number, the entity and the partitions of which it is a part, its position or
/// bounding box, its physical groups, and the entities that bound it.
bool Gmsh41Sections::ReadEntity(int dimension, bool partitioned, NumberStream& stream) {
  int32_t number = 0;
  std::array<int32_t, 2> parent{};
  std::vector<double> place;
  uint64_t count = 0;
  std::vector<int32_t> partitions, physicals, bounds;
  if (!stream.Take(number)) return false;
  if (partitioned &&
      (!stream.TakeAll(parent) || !stream.Take(count) || !TakeMany(count, stream, partitions))) {
    return false;
  }
  if (!TakeMany(dimension == 0 ? 3 : 6, stream, place) || !stream.Take(count) ||
      !TakeMany(count, stream, physicals)) {
    return false;
  }
  physicals_[{dimension, number}] = std::move(physicals);
  return dimension == 0 || (stream.Take(count) && TakeMany(count, stream, bounds));
}

absl::Status Gmsh41Sections::ReadNodes(NumberStream& stream) {
  std::array<uint64_t, 4> header{};  // blocks, nodes, least and greatest number
  if (!stream.TakeAll(header)) return Malformed("nodes");
  RETURN_IF_ERROR(CheckNodeCountOfFile(header[1]));
  for (uint64_t block = 0; block < header[0]; ++block) {
    RETURN_IF_ERROR(ReadNodeBlock(stream));
  }
  return absl::OkStatus();
}

/// Numbers first, then places, with their parameters on the curve or surface where the block has
/// them.
absl::Status Gmsh41Sections::ReadNodeBlock(NumberStream& stream) {
  std::array<int32_t, 3> entity{};  // dimension, number, whether there are parameters
  uint64_t count = 0;
  std::vector<uint64_t> numbers;
  if (!stream.TakeAll(entity) || !stream.Take(count) || entity[0] < 0 || entity[0] > 3) {
    return Malformed("nodes");
  }
  ElementFile& file = elements_.file;
  RETURN_IF_ERROR(CheckNodeCountOfFile(count));
  if (!TakeMany(count, stream, numbers)) return Malformed("nodes");
  const int parameter_count = entity[2] != 0 ? entity[0] : 0;
  for (const uint64_t number : numbers) {
    Point p{};
    std::vector<double> parameters;
    if (!stream.TakeAll(p) ||
        !TakeMany(static_cast<uint64_t>(parameter_count), stream, parameters)) {
      return Malformed("nodes");
    }
    file.node_numbers.push_back(static_cast<int64_t>(number));
    file.nodes.push_back(p);
  }
  return CheckNodeCountOfFile(file.nodes.size());
}

absl::Status Gmsh41Sections::ReadElements(NumberStream& stream) {
  std::array<uint64_t, 4> header{};  // blocks, elements, least and greatest number
  if (!stream.TakeAll(header)) return Malformed("elements");
  for (uint64_t block = 0; block < header[0]; ++block) {
    RETURN_IF_ERROR(ReadElementBlock(stream));
  }
  return absl::OkStatus();
}

absl::Status Gmsh41Sections::ReadElementBlock(NumberStream& stream) {
  std::array<int32_t, 3> entity{};  // dimension, number, type of the elements
  uint64_t count = 0;
  if (!stream.TakeAll(entity) || !stream.Take(count)) return Malformed("elements");
  const GmshKind* kind = FindGmshKind(entity[2]);
  if (kind == nullptr) return UnknownGmshKind(entity[2]);
  const std::vector<int32_t>& physicals = physicals_[{entity[0], entity[1]}];
  std::vector<uint64_t> figures(1 + kind->node_count);  // its number, then its nodes
  std::vector<int64_t> nodes(kind->node_count);
  for (uint64_t i = 0; i < count; ++i) {
    if (!stream.TakeAll(figures)) return Malformed("elements");
    for (size_t n = 0; n < nodes.size(); ++n) nodes[n] = static_cast<int64_t>(figures[n + 1]);
    RETURN_IF_ERROR(elements_.Add(*kind, physicals, nodes));
  }
  return absl::OkStatus();
}

}  // namespace carillon::precompute
