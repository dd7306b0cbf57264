// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "client_sdk/motion/contact_search.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// Blows of a ball, or of a body that does not tip, that hops on a plane of a fixed body, some of
/// them less than a frame apart. Momenta alone cannot tell such blows apart.
struct HopSeries {
  uint32_t pair = 0;
  /// No other blow of the pair lies between these times since the first frame, s.
  double first_s = 0, last_s = 0;
  std::vector<FoundBlow> blows;
};

/// Finds series of hops that begin near the blows that were found without them. Each flight and the
/// heights at the frames tell when and how fast the body lands, and with which coefficient of
/// restitution it goes on. Between two frames all hops have one coefficient, and where the heights
/// leave it open, it is near that of the hop before.
std::vector<HopSeries> FindHops(const Motion& motion, const SearchBodies& bodies,
                                const ContactSearch& search, const FoundContacts& found);

/// Removes the candidates for which the series stand.
void RemoveHops(const Motion& motion, int bin_count, const std::vector<HopSeries>& series,
                std::vector<Candidate>& candidates);

}  // namespace carillon::motion
