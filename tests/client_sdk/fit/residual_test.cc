// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/residual.h"

#include <gtest/gtest.h>

#include "client_sdk/fit/mode_extraction.h"
#include "tests/client_sdk/fit/struck_body.h"

namespace carillon::fit {
namespace {

TEST(ResidualOf, TakesTheModesOfAStrikeThatIsALittleOffTheOthers) {
  const std::vector<TrueMode> modes = {{500, 1, 0.1}, {1310, 3, 0.1}, {2740, 6, 0.1}};
  std::vector<TrueMode> higher = modes;
  for (TrueMode& mode : higher) mode.frequency_hz *= 1.0002;
  const std::vector<Ring> rings = FindRings({Struck(modes, 1e-5), Struck(higher, 1e-5)});
  ASSERT_EQ(rings.size(), 2U);
  const ExtractedModes found = ExtractModes(rings, [](double /*done*/) {});
  for (size_t ring = 0; ring < rings.size(); ++ring) {
    const Residual residual = ResidualOf(rings[ring], ring, found.modes);
    ASSERT_EQ(residual.shares.size(), 4U);
    EXPECT_EQ(residual.samples.size(), rings[ring].samples.size());
    // Without a fit to each strike 18 and 4 % are left.
    EXPECT_LT(residual.shares[3].share, 1e-3) << ring;
  }
}

}  // namespace
}  // namespace carillon::fit
