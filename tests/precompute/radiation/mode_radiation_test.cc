// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/mode_radiation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "precompute/radiation/solve_radiation.h"

namespace carillon::precompute {
namespace {

using Complex = std::complex<double>;

TEST(SphereGrid, SynthesisIsTheInverseOfAnalysis) {
  const SphereGrid grid(7);
  std::vector<Complex> coefficients;
  for (size_t i = 0; i < HarmonicCount(7); ++i) {
    const auto x = static_cast<double>(i);
    coefficients.emplace_back(std::sin(3 * x + 1), std::cos(5 * x));
  }
  const std::vector<Complex> values = grid.Synthesise(coefficients);
  const std::vector<double> harmonics = RealHarmonics(7, grid.directions()[40]);
  Complex direct = 0;
  for (size_t i = 0; i < coefficients.size(); ++i) direct += coefficients[i] * harmonics[i];
  EXPECT_NEAR(std::abs(values[40] - direct), 0, 1e-12);
  const std::vector<Complex> again = grid.Analyse(values);
  for (size_t i = 0; i < coefficients.size(); ++i) {
    EXPECT_NEAR(std::abs(again[i] - coefficients[i]), 0, 1e-12) << i;
  }
}

/// A mode whose pattern is that of order 1 with another of order 3, weaker by `level_db`.
ModeRadiation Expand(double level_db, const SphereGrid& grid, std::vector<Complex>& pattern) {
  std::vector<Complex> coefficients(HarmonicCount(grid.order()));
  coefficients[HarmonicIndex(1, 0)] = 1;
  coefficients[HarmonicIndex(3, 2)] = std::pow(10, level_db / 20);
  pattern = grid.Synthesise(coefficients);
  ModeRadiation mode;
  mode.wavenumber = 5;
  mode.power_integral = 1;
  ExpandPattern(pattern, grid, mode);
  return mode;
}

TEST(KeptPattern, IsThePatternUnlessHarmonicsAreLeftOut) {
  const SphereGrid grid(5);
  std::vector<Complex> pattern;
  const ModeRadiation whole = Expand(-18, grid, pattern);
  EXPECT_EQ(whole.index.size(), 2U);
  EXPECT_LT(DirectionDifferenceDb(KeptPattern(whole, grid), pattern, grid), 0.1);
  const ModeRadiation cut = Expand(-41, grid, pattern);
  EXPECT_EQ(cut.index.size(), 1U);
  const double left_out_db = DirectionDifferenceDb(KeptPattern(cut, grid), pattern, grid);
  EXPECT_GT(left_out_db, 0.05);
  EXPECT_LT(left_out_db, 0.8);
}

}  // namespace
}  // namespace carillon::precompute
