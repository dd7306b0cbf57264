// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/statusor.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// Finds the contacts that explain how bodies move, by the balance of their momenta: an impulse in
/// a cone of friction wherever bodies may have touched, so that the unexplained momentum is least.
/// Errors: InvalidArgument (NO_MOTION: fewer than four frames, or no body with a mass moves;
/// MOTION_TOO_COARSE: a body turns by more than 2.5 rad between two frames, unless
/// `even_if_coarse`; MOTION_MALFORMED: a pose is not finite, bodies have different numbers of
/// frames, a mass or an inertia is not above zero).
absl::StatusOr<FoundContacts> FindContacts(const Motion& motion, bool even_if_coarse = false);

}  // namespace carillon::motion
