// SPDX-License-Identifier: AGPL-3.0-or-later
//
// radiation_fork: prints levels round the tines of a tuning fork as a Markdown table.
#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

#include "tests/precompute/radiation/fork.h"

namespace carillon::precompute {
namespace {

void PrintFork() {
  constexpr std::array<size_t, 7> kDegrees = {15, 30, 45, 60, 75, 80, 90};
  std::printf("dB against the direction in which the tines move\n\n| distance |");
  for (const size_t degree : kDegrees) std::printf(" %zu degrees |", degree);
  std::printf(" least | at |\n| --- |");
  for (size_t i = 0; i < kDegrees.size() + 2; ++i) std::printf(" --- |");
  for (const double distance_m : {0.05, 0.2, 0.8, 100.0}) {
    const std::vector<double> levels = LevelsRoundFork(distance_m);
    const auto least = std::min_element(levels.begin(), levels.end());
    std::printf("\n| %g m |", distance_m);
    for (const size_t degree : kDegrees) std::printf(" %.1f |", levels[degree]);
    std::printf(" %.0f | %td degrees |", *least, least - levels.begin());
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace
}  // namespace carillon::precompute

int main() { carillon::precompute::PrintFork(); }
