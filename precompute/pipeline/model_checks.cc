// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/model_checks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/surface_shells.h"
#include "precompute/modes/audible_modes.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"

namespace carillon::precompute {
namespace {

/// A body is compact if its volume is above this part of its diagonal cubed; a cube has 0.19. For
/// unit speed of sound and diagonal, the first mode of a compact body lies below this frequency.
constexpr double kCompactVolume = 0.02;
constexpr double kFirstOfCompactHz = 1;

}  // namespace

absl::Status CheckUnit(double extent_m, const IntendedUse& use) {
  constexpr double kMostWavelengths = 100;
  const double speed_m_per_s = std::sqrt(use.young_pa / use.density_kg_per_m3);
  const double highest_hz = kMostWavelengths * speed_m_per_s / extent_m;
  if (use.size != 1 || extent_m <= kLikelyExtentM || use.high_hz <= highest_hz) {
    return absl::OkStatus();
  }
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MESH_UNIT_UNCLEAR",
      absl::StrFormat("the body is %.4g m long if the lengths of its file are metres: give their "
                      "unit, such as --unit mm, or --unit m if they are metres indeed",
                      extent_m));
}

void WarnOfUnit(double extent_m, const IntendedUse& use, std::vector<std::string>& warnings) {
  constexpr double kUnusualExtentM = 3;
  if (use.size != 1 || extent_m <= kUnusualExtentM) return;
  warnings.push_back(
      absl::StrFormat("the body is %.4g m long, because no unit is stated and lengths then are "
                      "metres; if they are not, give their unit, such as --unit mm",
                      extent_m));
}

bool MayBeTooSmall(const SurfaceMesh& surface, const IntendedUse& use) {
  const double diagonal_m = Diagonal(surface.vertices);
  double volume_m3 = 0;
  for (const Shell& shell : FindShells(surface)) volume_m3 += shell.volume_m3;
  const double high_hz = std::sqrt(use.UnitEigenvalue(use.high_hz)) / (2 * std::numbers::pi);
  return std::abs(volume_m3) > kCompactVolume * std::pow(diagonal_m, 3) &&
         kFirstOfCompactHz / diagonal_m > high_hz;
}

bool IsSurelyAboveBand(const ModalModel& model, const IntendedUse& use) {
  if (!model.eigenvalues.empty()) return false;
  const double first_hz = use.FrequencyHz(model.lowest_eigenvalue);
  return first_hz > use.high_hz * (1 + 2 * model.lowest_error);
}

absl::Status CheckBand(const ModalModel& model, const IntendedUse& use) {
  const double lowest = use.UnitEigenvalue(use.low_hz);
  if (std::ranges::any_of(model.eigenvalues, [&](double x) { return x >= lowest; })) {
    return absl::OkStatus();
  }
  const double first_hz = use.FrequencyHz(model.lowest_eigenvalue);
  const std::string below = model.eigenvalues.empty()
                                ? ""
                                : absl::StrFormat(" and the last below the band is %.5g Hz",
                                                  use.FrequencyHz(model.eigenvalues.back()));
  absl::Status status =
      Refusal(absl::StatusCode::kFailedPrecondition, "NO_MODE_IN_BAND",
              absl::StrFormat(
                  "no natural frequency of the body lies between %g and %g Hz, its first is "
                  "%.5g Hz%s; check the unit of the file, or choose another size, material or band",
                  use.low_hz, use.high_hz, first_hz, below));
  AddFigure(status, "first_mode_hz", absl::StrFormat("%.6g", first_hz));
  return status;
}

absl::Status LeaveOutInaccurate(double limit, const IntendedUse& use, ModalModel& model) {
  std::vector<size_t> kept;
  std::vector<size_t> left_out;
  for (size_t m = 0; m < model.eigenvalues.size(); ++m) {
    (model.estimated_errors[m] > limit ? left_out : kept).push_back(m);
  }
  if (!(limit > 0) || left_out.empty()) return absl::OkStatus();
  if (kept.empty()) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "ACCURACY_NOT_REACHED",
                   absl::StrFormat("all %d modes are estimated to be off by more than the %.3g %% "
                                   "allowed, the best by %.3g %%; allow more, or ask for a finer "
                                   "mesh (nodes, accuracy or budget)",
                                   left_out.size(), 100 * limit,
                                   100 * *std::ranges::min_element(model.estimated_errors)));
  }
  const double lowest = model.eigenvalues[left_out.front()];
  model.warnings.push_back(absl::StrFormat(
      "%d modes, the lowest at %.5g Hz, were left out because they are estimated to be off by more "
      "than the %.3g %% allowed; a finer mesh (nodes, accuracy or budget) keeps them",
      left_out.size(), use.FrequencyHz(lowest), 100 * limit));
  model.complete_to_eigenvalue = std::min(model.complete_to_eigenvalue, std::nextafter(lowest, 0));
  KeepModes(kept, model);
  return absl::OkStatus();
}

}  // namespace carillon::precompute
