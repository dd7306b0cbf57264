// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/live_output.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "server/live_output/final_fade.h"
#include "tests/server/scene/stage.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// An output on the null device that pauses soon.
class PausingOutputTest : public testing::Test {
 protected:
  void AwaitPause() const {
    while (!output_->paused()) std::this_thread::yield();
  }

  /// Waits for a pause, and for a while in it, and returns by how many frames more the mixer has
  /// gone on than the machine's clock, from the end of this pause to the end of the next.
  double FramesAhead() {
    std::array<nanoseconds, 2> times{};
    std::array<uint64_t, 2> frames{};
    const uint64_t lost = output_->state().lost_frame_count;
    for (size_t pause = 0; pause < times.size(); ++pause) {
      AwaitPause();
      const nanoseconds end = clock_.Monotonic() + milliseconds(50);
      while (clock_.Monotonic() < end) std::this_thread::yield();
      EXPECT_TRUE(output_->mixer().OpenStream().ok());
      times[pause] = clock_.Monotonic();
      frames[pause] = output_->mixer().frame();
    }
    const std::chrono::duration<double> elapsed = times[1] - times[0];
    // Frames that a busy machine did not render in time are lost.
    return static_cast<double>(frames[1] - frames[0] + output_->state().lost_frame_count - lost) -
           elapsed.count() * output_->format().sample_rate_hz;
  }

  SystemClock clock_;
  std::unique_ptr<LiveOutput> output_ = *LiveOutput::Start(
      {.device = "null", .pause_after = milliseconds(30)}, clock_, [](const std::string&) {});
};

TEST_F(PausingOutputTest, TheFramesGoOnWithTimeThroughPausesAndAStreamFindsThePresentOne) {
  // The ring buffer may be empty at one end, and a pause begins and ends between two blocks.
  const double tolerance = (8 + 2) * output_->format().block_frame_count;
  double ahead = 2 * tolerance;
  // A busy machine may keep the threads from running where a pause ends.
  for (int attempt = 0; attempt < 20 && std::abs(ahead) > tolerance; ++attempt) {
    ahead = FramesAhead();
  }
  EXPECT_LT(std::abs(ahead), tolerance);
}

TEST_F(PausingOutputTest, AContactAfterAPauseSoundsInTime) {
  SceneRegistry scenes(output_->mixer());
  const uint64_t scene = *scenes.CreateScene();
  const uint32_t handle = scenes.AddObject(scene, 0, SmallModel(), SmallProperties())->handle;
  for (bool in_time = false; !in_time;) {
    AwaitPause();
    const nanoseconds begin = clock_.Monotonic();
    const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.01});
    StrikeAt(stream->intake(), 0, {SmallImpulse(handle)});
    in_time = clock_.Monotonic() - begin < milliseconds(10);  // else the machine is too busy
    while (!stream->settled()) std::this_thread::yield();
    EXPECT_EQ(stream->counts().accepted_count + stream->counts().late_count, 1U);
    if (in_time) {
      EXPECT_EQ(stream->counts().late_count, 0U);
    }
    while (output_->state().peak == 0) std::this_thread::yield();
  }
}

TEST_F(PausingOutputTest, AListenerEndsAPauseAndHearsEveryBlock) {
  AwaitPause();
  std::counting_semaphore<> woken{0};
  auto listener = *output_->Listen(std::nullopt, [&woken] { woken.release(); });
  EXPECT_FALSE(output_->paused());
  std::optional<uint64_t> next;
  for (int count = 0; count < 20;) {
    const auto block = listener->TryTake();
    if (block == nullptr) {
      woken.acquire();
      continue;
    }
    EXPECT_EQ(block->first_frame, next.value_or(block->first_frame));
    next = block->first_frame + output_->format().block_frame_count;
    ++count;
  }
  EXPECT_FALSE(output_->paused());
  EXPECT_EQ(listener->lost_frame_count(), 0U);
  listener.reset();
  AwaitPause();
}

TEST_F(PausingOutputTest, AMoveByACallInAPauseIsTaken) {
  SceneRegistry scenes(output_->mixer());
  const uint64_t scene = *scenes.CreateScene({.hearing = {.distance_gain = true}, .listener = {}});
  const uint32_t handle = scenes.AddObject(scene, 0, SmallModel(), SmallProperties())->handle;
  AwaitPause();
  ObjectChange move;
  move.pose = Pose{.position_m = {1, 0, 0}};
  // The stream of moves has no room for more of them. A busy machine may refuse some.
  for (size_t count = 0; count <= SceneRegistry::kMaxObjectCount;) {
    count += scenes.UpdateObject(scene, handle, move).ok() ? 1 : 0;
  }
  AwaitPause();
}

constexpr DeviceFormat kStereo{
    .sample_rate_hz = 48000, .block_frame_count = 128, .channel_count = 2};

std::vector<float> Ones() { return std::vector<float>(kStereo.block_size(), 1.0F); }

TEST(FinalFade, FallsWithoutAStepToSilenceWithin50Ms) {
  FinalFade fade(kStereo);
  std::vector<float> before = Ones();
  fade.Apply(before);
  EXPECT_EQ(before, Ones());
  EXPECT_FALSE(fade.ended());
  fade.Begin();
  float last = 1;
  size_t sounding_frame_count = 0;
  while (!fade.ended()) {
    std::vector<float> block = Ones();
    fade.Apply(block);
    for (size_t i = 0; i < block.size(); i += 2) {
      EXPECT_EQ(block[i], block[i + 1]);  // both channels fade alike
      // The steepest slope of a raised cosine is pi/2 over its length.
      EXPECT_LE(std::abs(block[i] - last), 1.6 / 2400);
      last = block[i];
      if (last > 0) ++sounding_frame_count;
    }
  }
  EXPECT_EQ(last, 0);
  EXPECT_LE(sounding_frame_count, 2400U);
  EXPECT_GE(sounding_frame_count, 2390U);  // the last ones are below the smallest float's step
}

}  // namespace
}  // namespace carillon
