// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/far_pattern.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace carillon::precompute {
namespace {

constexpr size_t kSourceFloats = 9;

SweepTargets AsTargets(const std::vector<Point>& directions) {
  const size_t padded = (directions.size() + kSweepGrain - 1) / kSweepGrain * kSweepGrain;
  SweepTargets targets;
  for (auto* values : {&targets.x, &targets.y, &targets.z}) values->assign(padded, 0);
  for (size_t d = 0; d < directions.size(); ++d) {
    targets.x[d] = static_cast<float>(directions[d][0]);
    targets.y[d] = static_cast<float>(directions[d][1]);
    targets.z[d] = static_cast<float>(directions[d][2]);
  }
  return targets;
}

}  // namespace

int PatternOrder(double wavenumber, double radius_m) {
  return static_cast<int>(std::ceil(0.75 * wavenumber * radius_m + 8));
}

std::vector<std::complex<double>> FarPattern(const AcousticSurface& surface, const Point& center,
                                             double wavenumber, std::span<const ComplexFloat> p,
                                             const Displacement& displacement,
                                             const SphereGrid& grid, Workers& workers) {
  const double scale = wavenumber / std::numbers::pi;
  std::vector<float> sources;
  sources.reserve(kSourceFloats * surface.vertex_count());
  for (size_t v = 0; v < surface.vertex_count(); ++v) {
    const Point& n = surface.area_vectors[v];
    const auto& u = displacement[v];
    for (size_t a = 0; a < 3; ++a) {
      sources.push_back(static_cast<float>(scale * (surface.mesh.vertices[v][a] - center[a])));
    }
    for (const double x : n) sources.push_back(static_cast<float>(x));
    // This is b = -i k p, which SweepFar multiplies by d . N.
    sources.push_back(static_cast<float>(wavenumber * p[v].imag()));
    sources.push_back(static_cast<float>(-wavenumber * p[v].real()));
    sources.push_back(static_cast<float>(n[0] * u[0] + n[1] * u[1] + n[2] * u[2]));
  }
  const SweepTargets targets = AsTargets(grid.directions());
  std::vector<float> sums(2 * targets.x.size());
  workers.ForParts(targets.padded(), kSweepGrain, [&](int64_t begin, int64_t end, int) {
    SweepFar(targets, sources.data(), static_cast<int64_t>(surface.vertex_count()), begin, end,
             sums.data());
  });
  std::vector<std::complex<double>> pattern(grid.directions().size());
  for (size_t d = 0; d < pattern.size(); ++d) {
    pattern[d] = std::complex<double>(sums[d], sums[targets.x.size() + d]) / (4 * std::numbers::pi);
  }
  return pattern;
}

}  // namespace carillon::precompute
