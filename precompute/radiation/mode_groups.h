// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "precompute/radiation/solve_radiation.h"

namespace carillon::precompute {

/// Modes that are solved together, and their best result so far.
struct ModeGroup {
  std::vector<size_t> modes;  ///< one or two
  double wavenumber = 0;
  double loudness = 0;  ///< an estimate, by which groups are ordered
  /// The modes move the surface along its normals so little, as torsion does, that they are all but
  /// silent.
  bool silent = true;
  int first_level = 0;
  int solved_count = 0;           ///< levels, from the first on, on which the group was solved
  std::vector<ModeField> fields;  ///< the sound fields on the finest of these levels, one a mode
  double error_db = 0;            ///< of the worst mode; an error of directions counts a third

  int next_level() const { return first_level + solved_count; }
};

/// The modes whose wavenumbers lie between the bounds. Neighbours with almost the same wavenumber,
/// such as a degenerate pair, make one group.
std::vector<ModeGroup> GroupModes(std::span<const double> wavenumbers, double least,
                                  double greatest);

/// Low modes first, which need the coarsest surfaces and ring longest; among those of one surface
/// the loudest, as far as that is known.
void SortByNeed(std::vector<ModeGroup>& groups);

}  // namespace carillon::precompute
