// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/modal_model.h"

#include <utility>

#include "precompute/mesh/sounding_surface.h"
#include "precompute/modes/coupling.h"
#include "precompute/modes/error_estimate.h"

namespace carillon::precompute {
namespace {

std::vector<double> ToVector(const Eigen::VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

std::array<float, 3> ToFloat(const Point& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

std::vector<float> ShapesOnSurface(const SoundingSurface& surface, const Eigen::MatrixXd& shapes) {
  std::vector<float> result;
  result.reserve(3 * surface.nodes.size() * static_cast<size_t>(shapes.cols()));
  for (const int32_t node : surface.nodes) {
    for (int a = 0; a < 3; ++a) {
      for (Eigen::Index m = 0; m < shapes.cols(); ++m) {
        result.push_back(static_cast<float>(shapes(3 * Eigen::Index{node} + a, m)));
      }
    }
  }
  return result;
}

}  // namespace

ModalModel MakeModalModel(const TetMesh& mesh, const SurfaceMesh& given,
                          const ElasticConstants& elastic, const DeformationModes& solution) {
  SoundingSurface surface = MakeSoundingSurface(mesh);
  ModalModel model{
      .node_count = static_cast<int>(mesh.nodes.size()),
      .element_count = static_cast<int>(mesh.element_count()),
      .volume_m3 = VolumeM3(mesh),
      .complete_to_eigenvalue = solution.complete_to_eigenvalue,
      .lowest_eigenvalue = solution.lowest_eigenvalue,
      .verification = solution.verification,
      .left_out_mode_count = 0,
      .warnings = {},
      .eigenvalues = ToVector(solution.modes.eigenvalues),
      .residuals = ToVector(solution.residuals),
      .couplings = ToVector(Couplings(mesh, surface, solution.modes)),
      .estimated_errors = ToVector(EstimateFrequencyErrors(mesh, elastic, solution.modes)),
      .vertices = {},
      .triangles = std::move(surface.triangles),
      .given_triangle = std::move(surface.given_triangle),
      .given = given,
      .shapes = ShapesOnSurface(surface, solution.modes.shapes)};
  for (const int32_t node : surface.nodes) {
    model.vertices.push_back(ToFloat(mesh.nodes[static_cast<size_t>(node)]));
  }
  return model;
}

}  // namespace carillon::precompute
