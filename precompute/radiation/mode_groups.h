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
  double loudness = 0;  ///< an estimate for the order in which groups are solved
  /// Whether the modes, for example torsion, move the surface so little along its normals that they
  /// are almost silent.
  bool silent = true;
  int first_level = 0;
  int solved_count = 0;           ///< levels, from the first on, on which the group was solved
  std::vector<ModeField> fields;  ///< one sound field for each mode, on the finest of these levels
  double error_db = 0;            ///< of the worst mode; direction errors are divided by three

  int next_level() const { return first_level + solved_count; }
};

/// Groups the modes whose wavenumbers lie between the bounds. Two neighbours with almost the same
/// wavenumber, such as a degenerate pair, form one group.
std::vector<ModeGroup> GroupModes(std::span<const double> wavenumbers, double least,
                                  double greatest);

/// Sorts groups by the level on which they are solved next, the coarsest one first, because low
/// modes need the coarsest surfaces and ring longest. Groups of one level are sorted by loudness,
/// the loudest first.
void SortByNeed(std::vector<ModeGroup>& groups);

}  // namespace carillon::precompute
