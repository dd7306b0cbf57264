// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/modal_model.h"

#include <algorithm>
#include <utility>

#include "precompute/mesh/sounding_surface.h"
#include "precompute/modes/coupling.h"
#include "precompute/modes/error_estimate.h"
#include "precompute/modes/poisson_slopes.h"
#include "precompute/modes/region_energies.h"

namespace carillon::precompute {
namespace {

std::vector<double> ToVector(const Eigen::VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

std::array<float, 3> ToFloat(const Point& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

std::vector<float> ShapesOnSurface(const SoundingSurface& surface, const Eigen::MatrixXd& shapes) {
  // The shapes are transposed in parts that fit into the cache.
  constexpr size_t kPart = 256;
  const auto mode_count = static_cast<size_t>(shapes.cols());
  std::vector<float> result(3 * surface.nodes.size() * mode_count);
  for (size_t first = 0; first < surface.nodes.size(); first += kPart) {
    const size_t last = std::min(surface.nodes.size(), first + kPart);
    for (size_t m = 0; m < mode_count; ++m) {
      for (size_t n = first; n < last; ++n) {
        const double* from =
            &shapes(3 * Eigen::Index{surface.nodes[n]}, static_cast<Eigen::Index>(m));
        float* to = &result[3 * n * mode_count + m];
        for (size_t a = 0; a < 3; ++a) to[a * mode_count] = static_cast<float>(from[a]);
      }
    }
  }
  return result;
}

double ErrorOfLowest(const TetMesh& mesh, const BodyMaterials& materials, const Modes& above) {
  if (above.eigenvalues.size() == 0) return 0;
  return EstimateFrequencyErrors(mesh, materials, above).errors[0];
}

}  // namespace

ModalModel MakeModalModel(const TetMesh& mesh, const SurfaceMesh& given,
                          const BodyMaterials& materials, const DeformationModes& solution) {
  SoundingSurface surface = MakeSoundingSurface(mesh);
  ErrorEstimate estimate = EstimateFrequencyErrors(mesh, materials, solution.modes);
  ModalModel model{.node_count = static_cast<int>(mesh.nodes.size()),
                   .element_count = static_cast<int>(mesh.element_count()),
                   .volume_m3 = VolumeM3(mesh),
                   .complete_to_eigenvalue = solution.complete_to_eigenvalue,
                   .lowered_from_mode_count = solution.mode_count_below_asked,
                   .lowest_eigenvalue = solution.lowest_eigenvalue,
                   .lowest_error = ErrorOfLowest(mesh, materials, solution.above),
                   .verification = solution.verification,
                   .check = {},
                   .left_out_mode_count = 0,
                   .warnings = {},
                   .eigenvalues = ToVector(solution.modes.eigenvalues),
                   .residuals = ToVector(solution.residuals),
                   .couplings = ToVector(Couplings(mesh, surface, solution.modes)),
                   .estimated_errors = ToVector(estimate.errors),
                   .poisson_slopes = {},
                   .error_at_node = std::move(estimate.at_node),
                   .vertices = {},
                   .triangles = std::move(surface.triangles),
                   .given_triangle = std::move(surface.given_triangle),
                   .given = given,
                   .shapes = ShapesOnSurface(surface, solution.modes.shapes)};
  for (const int32_t node : surface.nodes) {
    model.vertices.push_back(ToFloat(mesh.nodes[static_cast<size_t>(node)]));
  }
  if (mesh.regions.empty()) {
    const ElasticConstants& elastic = materials.regions()[0].elastic;
    model.poisson_slopes = ToVector(PoissonSlopes(mesh, elastic, solution.modes));
    return model;
  }
  model.regions = RegionEnergies(mesh, materials, solution.modes);
  model.given_triangle_regions = GivenTriangleRegions(mesh, given);
  model.mass_moments = MassMoments(mesh, materials);
  return model;
}

}  // namespace carillon::precompute
