// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/device_keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <semaphore>

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

TEST_F(DeviceKeeperTest, WithoutAnySoundCardAutoIsNoFault) {
  const auto keeper = Start(Settings("auto", "/bin/true"));
  ASSERT_TRUE(keeper.ok()) << keeper.status();
  EXPECT_TRUE((*keeper)->state().plays);
  EXPECT_NE((*keeper)->state().message, "");
}

TEST_F(DeviceKeeperTest, RefusesAConfigurationThatCannotBecomeRight) {
  for (const DeviceSettings& settings : {Settings("speaker"), Settings("file:/nonexistent/out.wav"),
                                         Settings("portaudio", "/nonexistent")}) {
    EXPECT_FALSE(Start(settings).ok()) << settings.specification;
  }
}

TEST_F(DeviceKeeperTest, TellsItsObserverAtOnceWhetherTheDevicePlays) {
  const auto keeper = Start(Settings("null"));
  ASSERT_TRUE(keeper.ok()) << keeper.status();
  bool plays = false;
  (*keeper)->Observe([&plays](bool now) { plays = now; });
  EXPECT_TRUE(plays);
}

}  // namespace
}  // namespace carillon
