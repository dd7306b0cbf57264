// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/live_output.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>

#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"

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

  /// Returns the frame that is due by the machine's clock, counted from the first call. Frames that
  /// a busy machine did not render in time are lost.
  double DueFrame() {
    const nanoseconds now = clock_.Monotonic();
    if (begin_ == nanoseconds::zero()) {
      begin_ = now;
      first_frame_ = output_->mixer().frame();
    }
    const std::chrono::duration<double> elapsed = now - begin_;
    return static_cast<double>(first_frame_) + elapsed.count() * output_->format().sample_rate_hz -
           static_cast<double>(output_->state().lost_frame_count);
  }

  SystemClock clock_;
  std::unique_ptr<LiveOutput> output_ = *LiveOutput::Start(
      {.device = "null", .pause_after = milliseconds(30)}, clock_, [](const std::string&) {});
  nanoseconds begin_{};
  uint64_t first_frame_ = 0;
};

TEST_F(PausingOutputTest, TheFramesGoOnWithTimeThroughPausesAndAStreamFindsThePresentOne) {
  DueFrame();
  const double block = output_->format().block_frame_count;
  for (int pause = 0; pause < 3; ++pause) {
    AwaitPause();
    const nanoseconds paused_at = clock_.Monotonic();
    while (clock_.Monotonic() < paused_at + milliseconds(50)) std::this_thread::yield();
    const auto stream = output_->mixer().OpenStream();
    ASSERT_TRUE(stream.ok());
    EXPECT_FALSE(output_->paused());
    const double due = DueFrame();
    const auto frame = static_cast<double>(output_->mixer().frame());
    // The ring buffer may be empty, and each pause begins and ends between two blocks.
    const double tolerance = (8 + 2 * (pause + 1)) * block;
    EXPECT_GE(frame, due - tolerance) << pause;
    EXPECT_LE(frame, DueFrame() + tolerance) << pause;
  }
}

TEST_F(PausingOutputTest, AContactAfterAPauseSoundsInTime) {
  SceneRegistry scenes(output_->mixer());
  const uint64_t scene = *scenes.CreateScene();
  const uint32_t handle = scenes.AddObject(scene, 0, SmallModel(), SmallProperties())->handle;
  for (bool in_time = false; !in_time;) {
    AwaitPause();
    const nanoseconds begin = clock_.Monotonic();
    const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.01});
    ASSERT_TRUE(stream->intake().BeginStep(0).ok());
    stream->intake().Strike(SmallImpulse(handle));
    stream->intake().EndStep();
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
  // The stream of moves has room for this number of them.
  for (size_t i = 0; i <= SceneRegistry::kMaxObjectCount; ++i) {
    ASSERT_TRUE(scenes.UpdateObject(scene, handle, move).ok()) << i;
  }
  AwaitPause();
}

}  // namespace
}  // namespace carillon
