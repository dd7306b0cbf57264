// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/client_sdk/fit/struck_body.h"

namespace carillon::fit {
namespace {

constexpr double kSpeed_m_per_s = 5100, kNu = 0.34;

MeasuredBody Measured(const std::vector<size_t>& modes, const std::vector<double>& false_hz) {
  MeasuredBody body{
      .lines = IrregularLines(24), .frequencies_hz = false_hz, .frequency_errors_hz = {}};
  for (const size_t mode : modes) {
    // A scatter of 0.1 %.
    const double deviation = mode % 3 == 0 ? 1e-3 : -5e-4;
    body.frequencies_hz.push_back(kSpeed_m_per_s * body.lines.HertzAtUnitSpeed(mode, kNu) *
                                  (1 + deviation));
  }
  std::ranges::sort(body.frequencies_hz);
  for (const double hz : body.frequencies_hz) body.frequency_errors_hz.push_back(1e-4 * hz);
  return body;
}

TEST(FindMatches, FindsSpeedAndRatioAmongMissingAndFalseLines) {
  const std::vector<Match> matches =
      FindMatches({Measured({0, 1, 2, 4, 5, 6, 8, 10, 11, 13}, {1511, 4000, 9090})}, {});
  ASSERT_GE(matches.size(), 2U);
  EXPECT_NEAR(matches[0].speed_m_per_s / kSpeed_m_per_s, 1, 0.0025);
  EXPECT_NEAR(matches[0].poisson_ratio, kNu, 0.02);
  EXPECT_GE(matches[0].lines.size(), 10U);
  EXPECT_GT(matches[0].score - matches[1].score, 4);
  EXPECT_LT(std::abs(std::log(matches[0].speed_m_per_s / kSpeed_m_per_s)),
            3 * matches[0].speed_error + 1e-3);
}

TEST(FindMatches, FewLinesMatchInSeveralWays) {
  const std::vector<Match> matches = FindMatches({Measured({9, 10, 12}, {})}, {});
  ASSERT_GE(matches.size(), 2U);
  EXPECT_LT(matches[0].score - matches[1].score, 4);
}

TEST(FindMatches, TwoBodiesTellMoreThanOne) {
  const MeasuredBody one = Measured({1, 2, 4, 5}, {}), two = Measured({7, 8, 9, 11}, {});
  const auto odds = [](const std::vector<Match>& matches) {
    return matches[0].score - matches[1].score;
  };
  const std::vector<Match> both = FindMatches({one, two}, {});
  EXPECT_GT(odds(both), odds(FindMatches({one}, {})));
  EXPECT_EQ(both[0].lines.size(), 8U);
  EXPECT_NEAR(both[0].speed_m_per_s / kSpeed_m_per_s, 1, 0.004);
}

TEST(FindMatches, OfTwoLinesNearAModeTheLouderIsMatched) {
  MeasuredBody body = Measured({0, 1, 2, 3, 4, 5, 6, 7}, {});
  const double loud_hz = body.frequencies_hz[5];
  body.frequencies_hz.insert(body.frequencies_hz.begin() + 5, 0.9985 * loud_hz);
  body.frequency_errors_hz.push_back(1);
  body.levels_db.assign(9, -3);
  body.levels_db[5] = -30;
  const std::vector<Match> matches = FindMatches({body}, {.poisson_ratio = kNu});
  ASSERT_FALSE(matches.empty());
  EXPECT_DOUBLE_EQ(matches[0].poisson_ratio, kNu) << "the given one";
  EXPECT_NEAR(matches[0].speed_m_per_s / kSpeed_m_per_s, 1, 0.001);
  for (const MatchedLine& line : matches[0].lines) {
    EXPECT_NE(line.measured, 5U) << "the quiet one";
  }
}

TEST(FindMatches, AModeExplainsNoMoreThanOneLine) {
  const MatchSettings settings{.least_speed_m_per_s = 0.98 * kSpeed_m_per_s,
                               .most_speed_m_per_s = 1.02 * kSpeed_m_per_s,
                               .poisson_ratio = kNu};
  MeasuredBody body = Measured({0, 1, 2, 3, 4, 5, 6}, {});
  const double alone = FindMatches({body}, settings)[0].score;
  for (const double hz : Measured({0, 1, 2, 3, 4, 5, 6}, {}).frequencies_hz) {
    body.frequencies_hz.push_back(1.001 * hz);
    body.frequency_errors_hz.push_back(1);
  }
  std::ranges::sort(body.frequencies_hz);
  const Match twice = FindMatches({body}, settings)[0];
  EXPECT_EQ(twice.lines.size(), 7U);
  EXPECT_LT(twice.score, alone);
}

}  // namespace
}  // namespace carillon::fit
