// SPDX-License-Identifier: Apache-2.0
//
// Who calls, and may do what.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "server/api/edge/access/access_table.h"
#include "server/api/edge/access/guess_limiter.h"
#include "server/api/edge/access/peer_name.h"
#include "server/base/sha256.h"
#include "tests/server/audio_device/manual_clock.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

class AccessTableFile : public testing::Test {
 protected:
  absl::StatusOr<AccessTable> Read(const std::string& text) {
    WriteBytes(file_, text);
    std::filesystem::permissions(file_, std::filesystem::perms(0600));
    return AccessTable::Read(file_);
  }

 private:
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_ / "access";
};

TEST_F(AccessTableFile, ACallerIsFoundByItsTokenOrCertificateAndHasTheRolesOfItsLine) {
  const auto table = *Read("# callers\n\nrobot  strike,submit\tsha256:" + Sha256Hex("secret") +
                           "\nconsole listen certificate:console.example.org\nanybody listen\n");
  const Principal* robot = table.FindToken("secret");
  ASSERT_NE(robot, nullptr);
  EXPECT_EQ(robot->name, "robot");
  EXPECT_TRUE(robot->has(Role::kStrike) && robot->has(Role::kSubmit) && robot->has(Role::kAny));
  EXPECT_FALSE(robot->has(Role::kListen) || robot->has(Role::kAdminister));
  EXPECT_EQ(table.FindToken("secre"), nullptr);
  EXPECT_EQ(table.FindToken(Sha256Hex("secret")), nullptr);
  EXPECT_EQ(table.FindToken(""), nullptr);
  const Principal* console = table.FindCertificate({"other", "console.example.org"});
  ASSERT_NE(console, nullptr);
  EXPECT_EQ(console->name, "console");
  EXPECT_EQ(table.FindCertificate({""}), nullptr);
  EXPECT_EQ(table.FindCertificate({"console.example"}), nullptr);
  EXPECT_TRUE(table.anybody().has(Role::kListen));
}

TEST_F(AccessTableFile, WithoutALineForAnybodyCallersThatShowNothingHaveNoRole) {
  const auto table = *Read("# nobody\n");
  EXPECT_FALSE(table.anybody().has(Role::kAny));
}

TEST_F(AccessTableFile, ALineThatIsWrongIsNamed) {
  const std::string digest(64, '0');
  for (const char* line : {"robot", "robot strike", "robot sing sha256:$", "robot strike sha256:0",
                           "robot strike md5:$", "robot strike certificate:",
                           "robot strike sha256:$ more", "anybody listen sha256:$", "anybody ,"}) {
    const std::string text = absl::StrReplaceAll(line, {{"$", digest}});
    EXPECT_THAT(Read("# one\n" + text + "\n").status().ToString(),
                testing::AllOf(HasSubstr("ACCESS_FILE_UNUSABLE: "), HasSubstr("line 2: ")))
        << line;
  }
}

TEST_F(AccessTableFile, TwoLinesThatContradictEachOtherAreNamed) {
  const std::string first = "robot strike sha256:" + Sha256Hex("secret") + "\n";
  const std::string console = "console listen certificate:console.example.org\n";
  for (const std::string& second :
       {"other administer sha256:" + Sha256Hex("secret"), "robot submit sha256:" + Sha256Hex("b"),
        std::string("other strike certificate:console.example.org"),
        std::string("anybody strike")}) {
    EXPECT_THAT(
        Read(absl::StrCat(first, console, "anybody listen\n", second, "\n")).status().ToString(),
        testing::AllOf(HasSubstr("ACCESS_FILE_UNUSABLE: "), HasSubstr("access line 4: "),
                       testing::ContainsRegex("that of line [12], too|line [13] gives")))
        << second;
  }
  const std::string next = "robot strike sha256:" + Sha256Hex("next") + "\n";
  const auto table = *Read(first + console + "anybody listen\n" + next);
  EXPECT_EQ(table.FindToken("secret")->name, "robot");
  EXPECT_EQ(table.FindToken("next")->name, "robot");
}

TEST(AccessTable, WithoutAFileAnybodyMayDoAllButAdminister) {
  const AccessTable table = AccessTable::ForThisMachine();
  for (const Role role : {Role::kAny, Role::kListen, Role::kStrike, Role::kSubmit}) {
    EXPECT_TRUE(table.anybody().has(role)) << RoleName(role);
  }
  EXPECT_FALSE(table.anybody().has(Role::kAdminister));
}

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

TEST(PeerName, ConnectionsOfAKnownProcessAreOneClientAndOthersClientsOfTheirOwn) {
  EXPECT_EQ(ProcessOfPeer("unix:pid-42/7"), ProcessOfPeer("unix:pid-42/8"));
  EXPECT_NE(ProcessOfPeer("unix:pid-42/7"), ProcessOfPeer("unix:pid-4/7"));
  EXPECT_NE(ProcessOfPeer("unix:pid-0/7"), ProcessOfPeer("unix:pid-0/8"));
  EXPECT_NE(ProcessOfPeer("ipv4:127.0.0.1:7"), ProcessOfPeer("ipv4:127.0.0.1:8"));
}

}  // namespace
}  // namespace carillon
