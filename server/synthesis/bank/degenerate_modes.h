// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "server/synthesis/bank/sounding_modes.h"

namespace carillon {

/// Joins the modes whose frequencies are equal because the body is symmetric, or nearly equal
/// because a mesh breaks the symmetry. The basis that a solver gives of such modes is arbitrary, so
/// the level of the sound must be that of their joint power, which does not depend on the basis.
/// The joined modes get their mean frequency and decay and, unless `band.directed`, the root mean
/// square of their couplings.
///
/// The modes of a pair differ in phase by a quarter period, so that their powers add up. More modes
/// of one frequency cannot differ in phase pairwise by a quarter period. Three or more neighbours
/// become a multiplet (SoundingMode::multiplet) if they lie within `band.pair_tolerance`, their
/// couplings within a factor of two, and the modes beside them at least kIsolation times as far
/// away as they are wide. In the dense spectrum of a plate, three modes are rarely so close by
/// chance. Of the other modes, the closest neighbours become pairs first, because an ovalling mode
/// of a tube may lie between two pairs.
///
/// `modes` ascend in frequency. The time is O(n log n), if few modes lie within the tolerance.
void JoinDegenerateModes(const SoundingBand& band, std::vector<SoundingMode>& modes);

}  // namespace carillon
