// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/imported_figures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/base/sha256.h"

namespace carillon {
namespace {

/// No body is larger than this, whatever its unit of length.
constexpr double kMostLength_m = 1e6;
constexpr double kMostVolume_m3 = kMostLength_m * kMostLength_m * kMostLength_m;
/// From thin air to heavy liquids.
constexpr double kLeastDensity_kg_per_m3 = 1e-3, kMostDensity_kg_per_m3 = 2e4;
/// The range that a scene's Hearing may have.
constexpr double kLeastSpeed_m_per_s = 10, kMostSpeed_m_per_s = 10'000;

/// False for NaN, too.
bool IsWithin(double value, double least, double most) { return value >= least && value <= most; }

absl::Status Impossible(absl::string_view reason, absl::string_view what, absl::string_view is,
                        absl::string_view must_be) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason,
                 absl::StrCat(what, " in the header is ", is, ", but must be ", must_be,
                              ": write the file again by an export, or correct the figure"));
}

absl::Status CheckDigest(absl::string_view reason, const std::string& digest) {
  if (digest.empty() || IsSha256Hex(digest)) return absl::OkStatus();
  return Impossible(reason, "mesh_digest", "no digest",
                    "64 lower-case hexadecimal digits, or empty if unknown");
}

}  // namespace

absl::Status CheckFigures(const v1::ModalModelHeader& header) {
  constexpr char kReason[] = "MODAL_MODEL_MALFORMED";
  if (!IsWithin(header.volume_m3(), 0, kMostVolume_m3)) {
    return Impossible(kReason, "volume_m3", absl::StrCat(header.volume_m3()),
                      "0 (unknown) to 1e18");
  }
  const double complete_to = header.complete_to_eigenvalue();
  if (!(std::isfinite(complete_to) && complete_to >= 0)) {
    return Impossible(kReason, "complete_to_eigenvalue", absl::StrCat(complete_to),
                      "a finite number that is not negative");
  }
  const auto& errors = header.estimated_errors();
  if (!errors.empty() && static_cast<uint32_t>(errors.size()) != header.mode_count()) {
    return Impossible(kReason, "the number of estimated_errors", absl::StrCat(errors.size()),
                      absl::StrCat("that of the modes, ", header.mode_count(), ", or 0"));
  }
  if (!std::ranges::all_of(errors, [](float e) { return std::isfinite(e) && e >= 0; })) {
    return Impossible(kReason, "one of estimated_errors", "negative or not finite",
                      "a finite number that is not negative");
  }
  const auto& slopes = header.poisson_slopes();
  if (!slopes.empty() && static_cast<uint32_t>(slopes.size()) != header.mode_count()) {
    return Impossible(kReason, "the number of poisson_slopes", absl::StrCat(slopes.size()),
                      absl::StrCat("that of the modes, ", header.mode_count(), ", or 0"));
  }
  if (!std::ranges::all_of(slopes, [](double slope) { return std::isfinite(slope); })) {
    return Impossible(kReason, "one of poisson_slopes", "not finite", "a finite number");
  }
  return CheckDigest(kReason, header.mesh_digest());
}

absl::Status CheckFigures(const v1::TransferHeader& header) {
  constexpr char kReason[] = "TRANSFER_MALFORMED";
  if (!(header.radius_m() > 0 && header.radius_m() <= kMostLength_m)) {
    return Impossible(kReason, "radius_m", absl::StrCat(header.radius_m()), "above 0, up to 1e6");
  }
  if (!IsWithin(header.air_density_kg_per_m3(), kLeastDensity_kg_per_m3, kMostDensity_kg_per_m3)) {
    return Impossible(kReason, "air_density_kg_per_m3",
                      absl::StrCat(header.air_density_kg_per_m3()), "0.001 to 20000");
  }
  if (!IsWithin(header.sound_speed_m_per_s(), kLeastSpeed_m_per_s, kMostSpeed_m_per_s)) {
    return Impossible(kReason, "sound_speed_m_per_s", absl::StrCat(header.sound_speed_m_per_s()),
                      "10 to 10000");
  }
  return CheckDigest(kReason, header.mesh_digest());
}

}  // namespace carillon
