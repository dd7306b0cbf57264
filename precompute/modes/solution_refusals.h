// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "precompute/modes/lower_limit.h"

namespace carillon::precompute {

absl::Status VerificationFailed(const std::string& what);

/// `count` modes lie below the limit of the band, and at most `limit` may be found.
absl::Status TooManyModes(int count, int limit);

/// Adds figures to the refusal of too many modes, from which remedies follow: the number of
/// unknowns, and an eigenvalue below which at most `most` modes lie, if `lower` has one.
absl::Status WithLowerLimit(absl::Status refusal, int unknown_count,
                            const absl::StatusOr<Counted>& lower, int most);

/// The body can move in `free_motions` ways without bending, more than the expected `rigid_count`.
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
