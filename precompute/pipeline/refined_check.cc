// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/refined_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "absl/strings/str_format.h"
#include "precompute/fem/assembly.h"
#include "precompute/mesh/curved_edges.h"
#include "precompute/mesh/fill/split_elements.h"
#include "precompute/mesh/point_math.h"
#include "precompute/modes/deformation_modes.h"
#include "precompute/modes/error_estimate.h"

namespace carillon::precompute {
namespace {

/// Meshes with fewer nodes are compared with finer ones.
constexpr size_t kFewNodes = 1000;
/// A mesh has long elements if this part of its volume is in elements whose longest edge is this
/// many times as long as their least height. Bars, plates and tubes that keep a surface of long
/// triangles had 26 to 400 in the median, default meshes 2 to 12.
constexpr double kLongPart = 0.5;
constexpr double kLongElement = 20;
/// Largest cost of the comparison. It covers all modes of an ordinary body, and the lowest modes of
/// a body that has thousands.
constexpr Means kComparisonMeans{.bytes = size_t{1} << 30U, .cpu_s = 3};
/// The estimate is too small where the errors are this many times as large.
constexpr double kMuchLarger = 1.5;
/// An error below this value is too small for a warning.
constexpr double kSmallError = 0.01;

bool IsLong(const std::array<Point, 4>& corners, double volume) {
  double longest = 0, largest_area = 0;
  for (const auto& [a, b] : kTetEdges) {
    longest = std::max(longest,
                       Distance(corners[static_cast<size_t>(a)], corners[static_cast<size_t>(b)]));
  }
  for (const auto& [a, b, c] : kTetFaces) {
    const std::array<Point, 3> face{corners[static_cast<size_t>(a)],
                                    corners[static_cast<size_t>(b)],
                                    corners[static_cast<size_t>(c)]};
    largest_area = std::max(largest_area, Norm(AreaNormal(face)) / 2);
  }
  return longest * largest_area > kLongElement * 3 * volume;
}

bool HasLongElements(const TetMesh& mesh) {
  double all = 0, in_long = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::array<Point, 4> corners;
    for (size_t i = 0; i < 4; ++i) {
      corners[i] = mesh.nodes[static_cast<size_t>(
          mesh.elements[e * static_cast<size_t>(mesh.nodes_per_element) + i])];
    }
    const double volume = TetVolume(corners[0], corners[1], corners[2], corners[3]);
    all += volume;
    if (IsLong(corners, volume)) in_long += volume;
  }
  return in_long > kLongPart * all;
}

/// The modes of the refined mesh and their estimated errors.
struct Reference {
  size_t node_count;
  DeformationModes solution;
  Eigen::VectorXd errors;
};

absl::StatusOr<Reference> SolveReference(const TetMesh& refined, const BodyMaterials& materials,
                                         MassSharing sharing, double limit) {
  const SystemMatrices system = Assemble(refined, materials, sharing);
  absl::StatusOr<DeformationModes> solution = SolveDeformationModes(
      system, refined, limit, [](SolveStage, double) {}, {.means = kComparisonMeans});
  if (!solution.ok()) return solution.status();
  Eigen::VectorXd errors = EstimateFrequencyErrors(refined, materials, solution->modes).errors;
  return Reference{refined.nodes.size(), *std::move(solution), std::move(errors)};
}

/// The comparison of a model with the modes of the refined mesh.
struct Comparison {
  bool estimate_is_small = false;
  double greatest_error = 0;
};

/// Raises the errors of the model's modes to those of the comparison. Modes that are not compared
/// lie above all others and are at least as inaccurate.
Comparison RaiseErrors(const Reference& reference, ModalModel& model) {
  const Eigen::VectorXd& eigenvalues = reference.solution.modes.eigenvalues;
  Comparison result;
  for (size_t m = 0; m < model.eigenvalues.size(); ++m) {
    const auto r = static_cast<Eigen::Index>(m);
    double error = result.greatest_error;
    if (r < eigenvalues.size()) {
      error = std::sqrt(model.eigenvalues[m] / eigenvalues[r]) * (1 + reference.errors[r]) - 1;
      result.greatest_error = std::max(result.greatest_error, error);
    }
    double& stated = model.estimated_errors[m];
    result.estimate_is_small |= error > kSmallError && error > kMuchLarger * stated;
    stated = std::max(stated, error);
  }
  return result;
}

}  // namespace

bool HasFewElements(const TetMesh& mesh) {
  if (mesh.nodes_per_element != 10) return false;
  if (mesh.nodes.size() >= kFewNodes && !HasLongElements(mesh)) return false;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    if (IsCurved(mesh, e)) return false;
  }
  return true;
}

TetMesh Refined(const TetMesh& mesh) {
  TetMesh refined = SplitElements(mesh);
  while (refined.nodes.size() < kFewNodes) refined = SplitElements(refined);
  return refined;
}

void CompareWith(const TetMesh& finer, const BodyMaterials& materials, MassSharing sharing,
                 ModalModel& model) {
  if (model.eigenvalues.empty()) return;
  const absl::StatusOr<Reference> reference =
      SolveReference(finer, materials, sharing, model.complete_to_eigenvalue);
  if (!reference.ok()) return;
  const double compared_to = reference->solution.complete_to_eigenvalue;
  const auto own = std::ranges::count_if(
      model.eigenvalues, [&](double eigenvalue) { return eigenvalue < compared_to; });
  const auto found = reference->solution.modes.eigenvalues.size();
  const Comparison comparison = RaiseErrors(*reference, model);
  if (found <= own && !comparison.estimate_is_small) return;
  model.warnings.push_back(absl::StrFormat(
      "the mesh of %d nodes has too few elements for this body: a comparison with smaller elements "
      "(%d nodes) shows frequencies up to %.3g %% too high, and %d modes where this model has %d; "
      "the stated errors are those of the comparison; let Carillon choose the mesh (leave out "
      "--keep-surface, keep_surface and small numbers of nodes), or ask for an accuracy",
      model.node_count, reference->node_count, 100 * comparison.greatest_error, found, own));
}

}  // namespace carillon::precompute
