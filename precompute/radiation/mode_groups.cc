// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/mode_groups.h"

#include <algorithm>
#include <tuple>

namespace carillon::precompute {
namespace {

/// Two modes are solved at their mean wavenumber if their wavenumbers differ by less than this
/// fraction.
constexpr double kPairWidth = 2e-3;

}  // namespace

std::vector<ModeGroup> GroupModes(std::span<const double> wavenumbers, double least,
                                  double greatest) {
  std::vector<ModeGroup> groups;
  for (size_t m = 0; m < wavenumbers.size(); ++m) {
    const double k = wavenumbers[m];
    if (k < least || k > greatest || !(k > 0)) continue;
    const double before = groups.empty() ? 0 : groups.back().wavenumber;
    if (!groups.empty() && groups.back().modes.size() == 1 && k - before < kPairWidth * k) {
      groups.back().modes.push_back(m);
      groups.back().wavenumber = (before + k) / 2;
    } else {
      groups.push_back({.modes = {m}, .wavenumber = k, .fields = {}});
    }
  }
  return groups;
}

void SortByNeed(std::vector<ModeGroup>& groups) {
  std::stable_sort(groups.begin(), groups.end(), [](const ModeGroup& a, const ModeGroup& b) {
    return std::tuple(a.next_level(), -a.loudness) < std::tuple(b.next_level(), -b.loudness);
  });
}

}  // namespace carillon::precompute
