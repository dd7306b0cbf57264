// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/audible_modes.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "absl/strings/str_format.h"

namespace carillon::precompute {
namespace {

double AreaM2(const ModalModel& model) {
  double area = 0;
  for (const auto& triangle : model.triangles) {
    std::array<std::array<double, 3>, 2> edges{};
    for (size_t e = 0; e < 2; ++e) {
      for (size_t a = 0; a < 3; ++a) {
        edges[e][a] = double{model.vertices[static_cast<size_t>(triangle[e + 1])][a]} -
                      double{model.vertices[static_cast<size_t>(triangle[0])][a]};
      }
    }
    const auto& [u, v] = edges;
    area += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                       u[0] * v[1] - u[1] * v[0]) /
            2;
  }
  return area;
}

template <typename T>
void Pick(const std::vector<size_t>& kept, std::vector<T>& values) {
  for (size_t k = 0; k < kept.size(); ++k) values[k] = values[kept[k]];
  values.resize(kept.size());
}

/// Returns the kept numbers of each row of `mode_count` numbers.
void PickColumns(const std::vector<size_t>& kept, size_t mode_count, std::vector<float>& rows) {
  size_t to = 0;
  for (size_t row = 0; row < rows.size(); row += mode_count) {
    for (const size_t m : kept) rows[to++] = rows[row + m];
  }
  rows.resize(to);
}

}  // namespace

std::vector<double> Audibilities(const ModalModel& model) {
  const double area = AreaM2(model);
  std::vector<double> result;
  for (size_t m = 0; m < model.eigenvalues.size(); ++m) {
    result.push_back(model.couplings[m] * model.couplings[m] / (model.eigenvalues[m] * area));
  }
  return result;
}

void KeepModes(const std::vector<size_t>& kept, ModalModel& model) {
  const size_t found = model.eigenvalues.size();
  PickColumns(kept, found, model.shapes);
  for (auto* values :
       {&model.eigenvalues, &model.residuals, &model.couplings, &model.estimated_errors}) {
    Pick(kept, *values);
  }
  if (!model.poisson_slopes.empty()) Pick(kept, model.poisson_slopes);
  for (ModelRegion& region : model.regions) {
    Pick(kept, region.strain_parts);
    Pick(kept, region.kinetic_parts);
  }
  model.left_out_mode_count += static_cast<int>(found - kept.size());
}

void KeepMostAudible(int count, ModalModel& model) {
  const size_t found = model.eigenvalues.size();
  const auto wanted = static_cast<size_t>(count);
  if (count <= 0 || wanted >= found) return;
  const std::vector<double> audibilities = Audibilities(model);
  std::vector<size_t> kept(found);
  std::iota(kept.begin(), kept.end(), 0);
  // Equally audible modes are ordered by frequency, so that the same mesh gives the same model.
  std::ranges::stable_sort(kept, std::greater(), [&](size_t m) { return audibilities[m]; });
  const double least = audibilities[kept[wanted - 1]] / audibilities[kept[0]];
  const double lost = audibilities[kept[wanted]] / audibilities[kept[0]];
  kept.resize(wanted);
  std::ranges::sort(kept);
  KeepModes(kept, model);
  model.warnings.push_back(absl::StrFormat(
      "of %d modes the %d most audible were kept and %d left out: those kept go down to %.1f dB "
      "below the loudest, those left out begin at %.1f dB",
      found, wanted, model.left_out_mode_count, -20 * std::log10(least), -20 * std::log10(lost)));
}

}  // namespace carillon::precompute
