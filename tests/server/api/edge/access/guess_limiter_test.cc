// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/guess_limiter.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

using std::chrono::seconds;

constexpr char kPeer[] = "ipv4:192.0.2.1:4711";

TEST(GuessLimiter, AnAddressMayShowTenWrongTokensAndThenOneASecondFromWhateverPort) {
  ManualClock clock;
  GuessLimiter limiter(clock);
  int count = 0;
  while (limiter.TakeWrong("ipv4:192.0.2.1:" + std::to_string(count))) ++count;
  EXPECT_EQ(count, 10);
  EXPECT_FALSE(limiter.TakeWrong(kPeer));
  EXPECT_TRUE(limiter.TakeWrong("ipv4:192.0.2.2:1"));
  clock.SleepUntil(clock.Monotonic() + seconds(1));
  EXPECT_TRUE(limiter.TakeWrong(kPeer));
  EXPECT_FALSE(limiter.TakeWrong(kPeer));
}

TEST(GuessLimiter, MeanwhileARightTokenIsTakenOnlyOfCallersThatWereLetInBefore) {
  ManualClock clock;
  GuessLimiter limiter(clock);
  EXPECT_TRUE(limiter.TakeRight(kPeer, "old"));
  while (limiter.TakeWrong(kPeer)) {
  }
  EXPECT_TRUE(limiter.TakeRight(kPeer, "old"));
  EXPECT_FALSE(limiter.TakeRight(kPeer, "new"));
  EXPECT_TRUE(limiter.TakeRight("ipv4:192.0.2.2:1", "new"));
  clock.SleepUntil(clock.Monotonic() + seconds(1));
  EXPECT_TRUE(limiter.TakeRight(kPeer, "new"));
}

TEST(GuessLimiter, ManyAddressesDoNotGrowItForEver) {
  ManualClock clock;
  GuessLimiter limiter(clock);
  while (limiter.TakeWrong(kPeer)) {
  }
  for (int i = 0; i < 10'000; ++i) {
    limiter.TakeWrong("ipv4:10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256) +
                      ":1");
  }
  clock.SleepUntil(clock.Monotonic() + seconds(10));
  EXPECT_TRUE(limiter.TakeWrong(kPeer));
}

TEST(GuessLimiter, AnAddressIsThatOfTheMachine) {
  EXPECT_EQ(AddressOfPeer("ipv4:192.0.2.1:4711"), "ipv4:192.0.2.1");
  EXPECT_EQ(AddressOfPeer("ipv4:127.0.0.1:1"), AddressOfPeer("ipv4:127.8.9.10:2"));
  EXPECT_EQ(AddressOfPeer("ipv4:127.0.0.1:1"), AddressOfPeer("ipv6:%5B::1%5D:2"));
  EXPECT_NE(AddressOfPeer("ipv4:127.0.0.1:1"), AddressOfPeer("ipv4:128.0.0.1:1"));
  EXPECT_EQ(AddressOfPeer("ipv6:%5B2001:db8::1%5D:1"), AddressOfPeer("ipv6:[2001:db8::2]:9"));
  EXPECT_NE(AddressOfPeer("ipv6:%5B2001:db8::1%5D:1"), AddressOfPeer("ipv6:[2001:db9::1]:1"));
  EXPECT_NE(AddressOfPeer("ipv6:[::ffff:192.0.2.1]:1"), AddressOfPeer("ipv6:[::ffff:192.0.2.2]:1"));
}

TEST(LimitedLog, LinesBeyondTheLimitAreCountedAndBytesOfStrangersEscaped) {
  ManualClock clock;
  std::vector<std::string> lines;
  {
    LimitedLog log(clock, "strangers", [&](const std::string& line) { lines.push_back(line); });
    log.Warn("\x1b[31m\n" + std::string(1000, 'x'));
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_EQ(lines[0].substr(0, 12), "\\x1b[31m\\nxx");
    EXPECT_LT(lines[0].size(), 500U);
    for (int i = 0; i < 100; ++i) log.Warn("again");
    EXPECT_EQ(lines.size(), 20U);
    clock.SleepUntil(clock.Monotonic() + seconds(1));
    log.Warn("at last");
    ASSERT_EQ(lines.size(), 22U);
    EXPECT_EQ(lines[20], "81 more lines about strangers were left out");
    log.Warn("left out");
  }
  EXPECT_EQ(lines.back(), "1 more lines about strangers were left out");
}

}  // namespace
}  // namespace carillon
