// SPDX-License-Identifier: Apache-2.0
//
// The way through PortAudio to a sound server, on a JACK server of its own without a sound card.
// Skips, with a reason, where that cannot run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/live_output/live_output.h"
#include "tests/server/audio_device/wav.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/scene/stage.h"

namespace carillon {
namespace {

/// Runs a program silently. Returns whether it succeeded.
bool Succeeds(const std::string& command) {
  return std::system((command + " < /dev/null > /dev/null 2>&1").c_str()) == 0;
}

/// A JACK server that nobody else uses, in real time but without hardware. It ends with the test at
/// the latest.
class JackServer {
 public:
  JackServer() {
    setenv("JACK_DEFAULT_SERVER", ("carillon-test-" + std::to_string(getpid())).c_str(), 1);
    setenv("JACK_NO_AUDIO_RESERVATION", "1", 1);
    setenv("JACK_NO_START_SERVER", "1", 1);
    process_ = fork();
    if (process_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      const char* command =
          "exec jackd -R -P 50 -d dummy -r 48000 -p 128 < /dev/null > /dev/null 2>&1";
      execl("/bin/sh", "sh", "-c", command, nullptr);
      _exit(127);
    }
    runs_ = Succeeds("jack_wait -w -t 10");
  }
  ~JackServer() {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  bool runs() const { return runs_; }

 private:
  pid_t process_ = -1;
  bool runs_ = false;
};

/// Everything that listeners are given from now on.
class Recorder {
 public:
  explicit Recorder(LiveOutput& output)
      : listener_(*output.Listen(std::nullopt, [this] { Drain(); })) {
    const std::lock_guard lock(mutex_);
    listening_ = listener_.get();
  }

  std::vector<float> sound() {
    const std::lock_guard lock(mutex_);
    return sound_;
  }

 private:
  void Drain() {
    const std::lock_guard lock(mutex_);
    if (listening_ == nullptr) return;
    while (const auto block = listening_->TryTake()) {
      sound_.insert(sound_.end(), block->samples.begin(), block->samples.end());
    }
  }

  std::mutex mutex_;
  std::vector<float> sound_;
  BlockBroadcast::Listener* listening_ = nullptr;
  std::unique_ptr<BlockBroadcast::Listener> listener_;  // last: ends before what Drain touches
};

/// Strikes of different strength for the next seconds, so that no two pieces are alike.
void StrikeForAWhile(SceneRegistry& scenes) {
  const uint64_t scene = *scenes.CreateScene();
  ASSERT_TRUE(scenes.AddObject(scene, 1, SmallModel(), SmallProperties()).ok());
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.1});
  for (int step = 0; step < 60; ++step) {
    StrikeAt(stream->intake(), 0.1 * step, {SmallImpulse(1, 0.5 + 0.01 * step)});
  }
}

const OutputSettings kSettings{.device = "portaudio:JACK Audio Connection Kit",
                               .device_program = CARILLON_AUDIO_PROGRAM};

TEST(JackDevice, PlaysBitForBitWhatListenersHear) {
  for (const char* program : {"/usr/bin/jackd", "/usr/bin/jack_capture"}) {
    ASSERT_TRUE(std::filesystem::exists(program))
        << program << " is not installed: deploy/setup.sh tests";
  }
  const JackServer jack;
  if (!jack.runs()) {
    GTEST_SKIP() << "jackd cannot run here: no shared memory, or no real-time priority";
  }
  const TemporaryFolder folder;
  SystemClock clock;
  const auto output = LiveOutput::Start(kSettings, clock, [](const std::string&) {});
  ASSERT_TRUE(output.ok()) << output.status();
  EXPECT_THAT((*output)->state().device, testing::HasSubstr("JACK"));
  // The look-ahead, and the two periods that JACK says lie between its clients and the ear.
  EXPECT_DOUBLE_EQ((*output)->state().latency_s, 10 * 128 / 48000.0);
  Recorder recorder(**output);
  SceneRegistry scenes((*output)->mixer());
  StrikeForAWhile(scenes);
  const std::string file = folder / "capture.wav";
  if (!Succeeds("jack_capture --daemon -c 1 -b FLOAT -p PortAudio:out_0 -d 2 " + file)) {
    GTEST_SKIP() << "jack_capture cannot run here";
  }
  const std::vector<float> captured = ReadWav(file).samples;
  const std::vector<float> listened = recorder.sound();
  if (const uint64_t xrun_count = (*output)->state().xrun_count; xrun_count > 0) {
    GTEST_SKIP() << "this machine is too busy for sound: " << xrun_count << " xruns";
  }
  ASSERT_GE(captured.size(), 90000U);
  // jack_capture sets in at some moment: its first half second says where in what was heard.
  const auto start =
      std::search(listened.begin(), listened.end(), captured.begin(), captured.begin() + 24000);
  ASSERT_NE(start, listened.end()) << "what was captured was never rendered";
  ASSERT_GE(listened.end() - start, static_cast<ptrdiff_t>(captured.size()));
  EXPECT_TRUE(std::equal(captured.begin(), captured.end(), start));
  EXPECT_GT(*std::ranges::max_element(captured), 0.001F);
}

}  // namespace
}  // namespace carillon
