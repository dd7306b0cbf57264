// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/device_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "server/live_output/loss_log.h"

namespace carillon {
namespace {

/// Is pulled from, and says so.
class PulledSource final : public FrameSource {
 public:
  void Pull(std::span<float> /*frames*/) noexcept override { pulled_.release(); }
  void AwaitPull() { pulled_.acquire(); }

 private:
  std::counting_semaphore<> pulled_{0};
};

/// A clock on which a hundred seconds pass within one.
class FastClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override { return 100 * clock_.Monotonic(); }
  int64_t UnixMs() const noexcept override { return clock_.UnixMs(); }
  void SleepUntil(std::chrono::nanoseconds time) override {
    std::this_thread::sleep_for((time - Monotonic()) / 100);
  }

 private:
  SystemClock clock_;
};

DeviceSettings Settings(const std::string& specification, const std::string& program = "") {
  return {.specification = specification, .format = {}, .program = program};
}

class DeviceKeeperTest : public testing::Test {
 protected:
  absl::StatusOr<std::unique_ptr<DeviceKeeper>> Start(const DeviceSettings& settings) {
    return DeviceKeeper::Start(settings, source_, clock_, [](const std::string&) {});
  }

  SystemClock clock_;
  PulledSource source_;
};

TEST_F(DeviceKeeperTest, PlaysOnNullWhileTheSoundCardThatWasNamedIsAway) {
  // A program that ends at once stands for a sound card that cannot be opened.
  const auto keeper = Start(Settings("portaudio:gone", "/bin/true"));
  ASSERT_TRUE(keeper.ok()) << keeper.status();
  source_.AwaitPull();
  const DeviceState state = (*keeper)->state();
  EXPECT_EQ(state.description, "null");
  EXPECT_THAT(state.message, testing::HasSubstr("no sound: "));
  EXPECT_FALSE(state.plays);
}

TEST_F(DeviceKeeperTest, AutoLooksMoreAndMoreRarelyForTheFirstSoundCard) {
  const std::filesystem::path folder = testing::TempDir() + "rare_tries";
  std::filesystem::create_directories(folder);
  std::filesystem::remove(folder / "tries");
  std::ofstream(folder / "audio") << "#!/bin/sh\necho >> " << (folder / "tries").string() << "\n";
  std::filesystem::permissions(folder / "audio", std::filesystem::perms::owner_all);
  FastClock clock;
  {
    const auto keeper = DeviceKeeper::Start(Settings("auto", folder / "audio"), source_, clock,
                                            [](const std::string&) {});
    ASSERT_TRUE(keeper.ok()) << keeper.status();
    clock.SleepUntil(clock.Monotonic() + std::chrono::seconds(60));
  }
  std::ifstream tries(folder / "tries");
  const auto count = std::count(std::istreambuf_iterator<char>(tries), {}, '\n');
  // At the start, after 0, 0.5, 1.5, 3.5, 7.5 and 15.5 s, and then every ten seconds at most.
  EXPECT_GE(count, 2);
  EXPECT_LE(count, 13);
}

TEST_F(DeviceKeeperTest, TellsItsObserverAtOnceWhetherTheDevicePlays) {
  const auto keeper = Start(Settings("null"));
  ASSERT_TRUE(keeper.ok()) << keeper.status();
  bool plays = false;
  (*keeper)->Observe([&plays](bool now) { plays = now; });
  EXPECT_TRUE(plays);
}

using ::std::chrono::seconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LossLogTest : public ::testing::Test {
 protected:
  /// Returns the lines since the last call.
  std::vector<std::string> Lines() { return std::exchange(lines_, {}); }

  std::vector<std::string> lines_;
  LossLog log_{48000, [this](const std::string& line) { lines_.push_back(line); }};
};

TEST_F(LossLogTest, NamesTheBeginningAndTheEndOfGapsOnceWithTheirFrames) {
  log_.Note(0, seconds(0), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800, seconds(1), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("the sound has gaps: 4800 frames (0.1 s) were lost")));
  for (int second = 2; second < 100; ++second) log_.Note(4800U * second, seconds(second), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99, seconds(158), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99, seconds(159), false);
  EXPECT_THAT(Lines(), ElementsAre(AllOf(HasSubstr("no gaps for 60 s"),
                                         HasSubstr("475200 frames (9.9 s) were lost"))));
  log_.Note(4800U * 99, seconds(250), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(4800U * 99 + 48, seconds(350), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("gaps: 48 frames (0.001 s) were lost")));
}

TEST_F(LossLogTest, FramesOfAFaultThatTheLogNamesAreNoGaps) {
  log_.Note(100, seconds(1), true);
  log_.Note(200, seconds(2), true);
  log_.Note(300, seconds(3), false);  // lost before the fault ended
  log_.Note(300, seconds(90), false);
  EXPECT_THAT(Lines(), IsEmpty());
  log_.Note(400, seconds(91), false);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("gaps: 100 frames")));
}

}  // namespace
}  // namespace carillon
