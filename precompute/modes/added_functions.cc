// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/added_functions.h"

#include "precompute/mesh/tet_mesh.h"

namespace carillon::precompute {
namespace {

FunctionAt Product(const FunctionAt& f, const FunctionAt& g) {
  return {f.value * g.value, f.value * g.derivative + g.value * f.derivative};
}

FunctionAt Coordinate(const Eigen::Vector4d& at, int i) {
  return {at[i], Eigen::Vector4d::Unit(i)};
}

}  // namespace

std::vector<FunctionAt> BaseFunctions(const Eigen::Vector4d& barycentric, int node_count) {
  std::vector<FunctionAt> functions;
  for (int i = 0; i < 4; ++i) {
    FunctionAt f = Coordinate(barycentric, i);
    if (node_count == 10) {
      f = Product(f, {2 * barycentric[i] - 1, 2 * Eigen::Vector4d::Unit(i)});
    }
    functions.push_back(f);
  }
  if (node_count == 4) return functions;
  for (const auto& [a, b] : kTetEdges) {
    const FunctionAt f = Product(Coordinate(barycentric, a), Coordinate(barycentric, b));
    functions.push_back({4 * f.value, 4 * f.derivative});
  }
  return functions;
}

std::vector<FunctionAt> AddedFunctions(const Eigen::Vector4d& barycentric, int node_count) {
  const Eigen::Vector4d& at = barycentric;
  std::vector<FunctionAt> functions;
  for (const auto& [a, b] : kTetEdges) {
    FunctionAt f = Product(Coordinate(at, a), Coordinate(at, b));
    if (node_count == 10) {
      f = Product(f, {at[a] - at[b], Eigen::Vector4d::Unit(a) - Eigen::Vector4d::Unit(b)});
    }
    functions.push_back(f);
  }
  if (node_count == 4) return functions;
  for (const auto& [a, b, c] : kTetFaces) {
    functions.push_back(Product(Product(Coordinate(at, a), Coordinate(at, b)), Coordinate(at, c)));
  }
  return functions;
}

}  // namespace carillon::precompute
