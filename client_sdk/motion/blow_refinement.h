// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client_sdk/motion/contact_search.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// Corrects the times and the impulses of blows by Gauss-Newton steps, so that with the loads they
/// balance the momenta of both frames around them, each at a time of its own. The motions of the
/// bodies follow the corrected blows, and the places of the contacts follow these motions. What the
/// momenta leave open, such as how the corners of a face share a blow, stays as it was found.
/// Bodies with joints are left alone.
void RefineBlows(const Motion& motion, const std::vector<BodyPair>& pairs, SearchBodies& bodies,
                 FoundContacts& found);

}  // namespace carillon::motion
