// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/motion/contact_problem.h"

namespace carillon::motion {

/// Reads blows and loads off a solved problem: a blow is an impulse far above the load around it,
/// and so is a load that leaps for a frame or two. The rest is load. The blows of `series` are
/// added.
FoundContacts ReadContacts(const Motion& motion, const SearchBodies& bodies,
                           const ContactSearch& search, const ContactProblem& problem,
                           const std::vector<HopSeries>& series);

/// Sets how the bodies lie at each blow, and how fast they approach each other: as fast as one bin
/// before, but after the blow before of either body, and as free flight has made them since then.
void SetApproaches(const Motion& motion, const SearchBodies& bodies, double bin_s,
                   FoundContacts& found);

/// Sets how much the blows differ from those of other solutions within a frame of them.
void SetAmbiguity(FoundContacts& found, const std::vector<FoundContacts>& others, double frame_s);

}  // namespace carillon::motion
