// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "precompute/modes/lower_limit.h"

namespace carillon::precompute {

absl::Status VerificationFailed(const std::string& what);

/// Returns the refusal of a body that has `count` modes below the limit of the band, of which at
/// most `limit` may be found.
absl::Status TooManyModes(int count, int limit);

/// Adds figures to the refusal of too many modes, from which remedies follow: the number of
/// unknowns and, if `lower` has one, an eigenvalue below which at most `most` modes lie.
absl::Status WithLowerLimit(absl::Status refusal, int unknown_count,
                            const absl::StatusOr<Counted>& lower, int most);

/// Returns the refusal of a body that can move in `free_motions` ways without bending, which are
/// more than the expected `rigid_count`. `is_fixed` says whether a part of the body is fixed.
absl::Status SeveralPieces(int free_motions, int rigid_count, bool is_fixed);

/// Properties of a body, for unit material, from which its slenderness follows.
struct Slenderness {
  double lowest_eigenvalue;  ///< of the deformation modes, about
  double stiffest;           ///< as StiffestNode() returns it
  double extent_m;
};

/// Returns BODY_TOO_SLENDER in place of a refusal that follows from rounding: on a slender body the
/// rounding error of K is not small beside the stiffness of the lowest modes, so that these modes
/// fail the verification or seem to be rigid. Other refusals, and those of other bodies, are
/// returned as they are.
absl::Status NamingSlenderness(absl::Status refusal, const Slenderness& body);

}  // namespace carillon::precompute
