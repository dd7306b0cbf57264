// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"
#include "proto/cpp/model_format.h"

namespace carillon::interchange {

/// A modal model in memory, in the form in which proto/carillon/v1/modal_model.proto stores it,
/// with Young's modulus and density of one. Arrays are flat and row-major. There are #m modes, #V
/// vertices and #T triangles of the sounding surface, and #G vertices and #H triangles of the
/// surface as given.
struct StoredModel {
  /// The header without `arrays` and `mode_count`, which the writers fill in.
  v1::ModalModelHeader header;
  std::vector<double> eigenvalues;        ///< #m, ascending
  std::vector<double> residuals;          ///< #m
  std::vector<double> couplings;          ///< #m
  std::vector<float> vertices;            ///< #V by 3, m
  std::vector<uint32_t> triangles;        ///< #T by 3
  std::vector<uint32_t> given_triangle;   ///< #T
  std::vector<float> given_vertices;      ///< #G by 3, m
  std::vector<uint32_t> given_triangles;  ///< #H by 3
  std::vector<float> shapes;              ///< #V by 3 by #m, 1/kg^(1/2)

  size_t mode_count() const { return eigenvalues.size(); }
  size_t vertex_count() const { return vertices.size() / 3; }
  size_t triangle_count() const { return triangles.size() / 3; }
};

/// Calls `visit(name, numbers, dimensions)` for each of kModelArrays in its order. Each character
/// of `dimensions` names one dimension of the array: a letter of ModelSizes, or '3'.
template <class Model, class Visitor>
void VisitArrays(Model& model, Visitor visit) {
  size_t index = 0;
  const auto next = [&](auto& numbers) {
    const ArraySpec& spec = kModelArrays[index++];
    visit(spec.name, numbers, spec.shape);
  };
  next(model.eigenvalues);
  next(model.residuals);
  next(model.couplings);
  next(model.vertices);
  next(model.triangles);
  next(model.given_triangle);
  next(model.given_vertices);
  next(model.given_triangles);
  next(model.shapes);
}

/// Returns the sizes for which the letters of VisitArrays stand.
std::vector<uint64_t> Shape(const StoredModel& model, std::string_view dimensions);

/// Checks that the sizes of the arrays agree, that numbers are finite, that eigenvalues are
/// positive and ascending, and that indices are in range. Errors: InvalidArgument
/// (MODEL_FILE_MALFORMED).
absl::Status Validate(const StoredModel& model);

}  // namespace carillon::interchange
