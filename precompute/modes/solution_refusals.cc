// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/modes/solution_refusals.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/eigen/verification.h"
#include "precompute/modes/mode_limits.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

/// The first bending mode of a free bar of square section has the angular frequency 6.46 t / l^2
/// for unit material (22.37 / sqrt(12)).
constexpr double kFirstBending = 6.46;
/// Bodies that are longer, in thicknesses, are refused as slender if they cannot be solved.
constexpr double kSlender = 300;
/// Steel rods of 1 m: 2 mm of thickness can be computed, 1 mm cannot.
constexpr int kMostSlender = 500;

}  // namespace

absl::Status VerificationFailed(const std::string& what) {
  return Refusal(absl::StatusCode::kInternal, "VERIFICATION_FAILED",
                 absl::StrCat(what, "; no model was made; try a tenth more nodes (--nodes)"));
}

absl::Status TooManyModes(int count, int limit) {
  const std::string keep =
      limit < kMaxFoundModeCount
          ? absl::StrCat(
                ", or keep only the most audible modes (--keep, keep_mode_count), with "
                "which the limit is ",
                kMaxFoundModeCount)
          : "";
  absl::Status status =
      Refusal(absl::StatusCode::kInvalidArgument, "TOO_MANY_MODES",
              absl::StrCat(count, " modes lie below the top of the band; the limit is ", limit,
                           "; lower the band's upper frequency", keep));
  AddFigure(status, "mode_count", absl::StrCat(count));
  return status;
}

/// Adds figures to the refusal of too many modes, from which remedies follow: the number of
/// unknowns, and an eigenvalue below which few enough modes lie.
absl::Status WithLowerLimit(absl::Status refusal, int unknown_count,
                            const absl::StatusOr<Counted>& lower, int most) {
  AddFigure(refusal, "unknown_count", absl::StrCat(unknown_count));
  if (lower.ok() && lower->count <= most) {
    AddFigure(refusal, "lower_eigenvalue", absl::StrFormat("%.6g", lower->limit));
  }
  return refusal;
}

absl::Status SeveralPieces(int free_motions, int rigid_count, bool is_fixed) {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MESH_SEVERAL_PIECES",
      absl::StrCat("the body can move in ", free_motions,
                   " ways without bending, a body in one piece",
                   is_fixed ? absl::StrCat(" fixed as this one in ", rigid_count) : " in six",
                   ": parts of it are separate, or hang together by an edge or a point only; join "
                   "them, or make each a body of its own"));
}

absl::Status NamingSlenderness(absl::Status refusal, const Slenderness& body) {
  const std::string reason = ToErrorInfo(refusal).reason();
  if (reason != "VERIFICATION_FAILED" && reason != "MESH_SEVERAL_PIECES") return refusal;
  const double slenderness = kFirstBending / (std::sqrt(body.lowest_eigenvalue) * body.extent_m);
  const double rounding = ResidualOfRounding(body.stiffest, body.lowest_eigenvalue);
  if (!(slenderness > kSlender) || rounding < kMostRounding) return refusal;
  return Refusal(
      absl::StatusCode::kInvalidArgument, "BODY_TOO_SLENDER",
      absl::StrFormat("the body is too slender: it is about %.0f times as long as thick, "
                      "so that rounding errors hide its lowest modes; bodies up to some "
                      "%d times as long as thick can be computed; make it thicker or "
                      "shorter",
                      10 * std::round(slenderness / 10), kMostSlender));
}

}  // namespace carillon::precompute
