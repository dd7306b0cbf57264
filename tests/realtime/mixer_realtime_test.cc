// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/realtime/forbidden_calls.h"
#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

std::unique_ptr<OscillatorBank> MakeBank(double decay_rate_per_s) {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 40; ++m) {
    sounding.modes.push_back(MakeMode(m, 200 + 150 * m, decay_rate_per_s));
  }
  sounding.modes[3].output_phase_rad = std::numbers::pi / 2;
  return std::make_unique<OscillatorBank>(sounding, MakeUniformShapes(40),
                                          OscillatorBankSettings{});
}

std::shared_ptr<Voice> MakeVoice(bool binaural) {
  static const auto head = std::make_shared<const Head>(SphereHead::Make());
  const HearingSettings all{
      .distance_gain = true, .propagation_delay = true, .panning = true, .binaural = binaural};
  return std::make_shared<Voice>(Voice::Settings{.hearing = all, .channel_count = 2, .head = head},
                                 Place(), Place());
}

TEST(MixerRealtime, TheWatchSeesMallocFreeAndLocks) {
  if (!kForbiddenCallsAreSeen) GTEST_SKIP() << "sanitizers replace these functions";
  const ForbiddenCalls calls;
  void* volatile memory = ::operator new(8);
  EXPECT_EQ(calls.count(), 1u);
  ::operator delete(memory);
  EXPECT_EQ(calls.count(), 2u);
  static std::mutex mutex;
  mutex.lock();
  mutex.unlock();
  EXPECT_EQ(calls.count(), 3u);
}

TEST(MixerRealtime, RenderNeitherAllocatesNorFreesNorLocks) {
  if (!kForbiddenCallsAreSeen) GTEST_SKIP() << "sanitizers replace these functions";
  Mixer mixer(
      {.channel_count = 2, .most_banks = 64, .most_streams = 2, .most_pending_events = 100});
  std::vector<float> block(2 * 128);
  std::vector<BankId> banks;
  auto stream = mixer.OpenStream(256).value();
  for (int i = 0; i < 300; ++i) {
    if (i % 5 == 0 && i < 250) {
      auto voice = i % 2 == 0 ? MakeVoice(i % 4 == 0) : nullptr;
      banks.push_back(mixer.Add(MakeBank(-300), std::move(voice)).value());
    }
    const Motion motion{.position_m = {1.0F * static_cast<float>(i), 0, 0},
                        .glide_frames = i % 4 == 0 ? 0.0F : 300.0F};
    MixerEvent move{.bank = banks.back(), .action = ObjectMove{motion}};
    if (i % 3 == 0) move.action = ListenerMove{motion};
    stream->TryPush(move);
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.pulse = Pulse::RaisedCosine(4e-4F);
    if (i % 7 == 0) impulse.impulse_newton_seconds[0] = std::numeric_limits<float>::quiet_NaN();
    // In time, between samples, late, and, while the heap is full, too many.
    for (uint64_t k = 0; k < 8; ++k) {
      stream->TryPush({.bank = banks[(static_cast<size_t>(i) + k) % banks.size()],
                       .frame = k == 0 ? 0 : mixer.frame() + 300 * k,
                       .fraction = 0.5F,
                       .action = impulse});
    }
    if (i % 11 == 0) mixer.LetRingOut(banks[static_cast<size_t>(i) % banks.size()]);
    if (i % 13 == 0) mixer.FadeOut(banks[static_cast<size_t>(i) % banks.size()]);
    if (i == 290) stream.reset();
    {
      const ForbiddenCalls calls;
      mixer.Render(block);
      ASSERT_EQ(calls.count(), 0u) << "block " << i;
    }
    if (i == 290) break;
  }
  const MixerStatistics statistics = mixer.statistics();
  EXPECT_GT(statistics.accepted_count, 0u);
  EXPECT_GT(statistics.late_count, 0u);
  EXPECT_GT(statistics.dropped_count, 0u);
}

/// From now on the kernel kills this process at its first system call but exit. Not the strict
/// mode, which forbids reading the processor's clock too.
void ForbidSystemCalls() {
  std::array<sock_filter, 4> filter = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
  }};
  const sock_fprog program{.len = filter.size(), .filter = filter.data()};
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
}

/// Runs `body` in a child without system calls; the child's status.
template <typename Body>
int RunWithoutSystemCalls(const Body& body) {
  const pid_t child = fork();
  if (child == 0) {
    ForbidSystemCalls();
    body();
    syscall(SYS_exit, 0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

TEST(MixerRealtime, ASystemCallIsSeen) {
  if (!kForbiddenCallsAreSeen) GTEST_SKIP() << "sanitizers call the system themselves";
  const int status = RunWithoutSystemCalls([] { syscall(SYS_getppid); });
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGSYS);
}

TEST(MixerRealtime, RenderMakesNoSystemCall) {
  if (!kForbiddenCallsAreSeen) GTEST_SKIP() << "sanitizers call the system themselves";
  SystemClock clock;
  clock.Monotonic();
  Mixer mixer({.most_banks = 8, .clock = &clock});
  const auto stream = mixer.OpenStream(4096).value();
  for (int bank = 0; bank < 8; ++bank) {
    const BankId id = mixer.Add(MakeBank(bank % 2 == 0 ? -3 : -300)).value();
    for (uint64_t i = 0; i < 200; ++i) {
      stream->TryPush({.bank = id, .frame = 90 * i, .fraction = 0.5F, .action = MakeUnitImpulse()});
    }
    if (bank == 5) mixer.FadeOut(id);
    if (bank == 6) mixer.LetRingOut(id);
  }
  std::vector<float> block(128);
  const int status = RunWithoutSystemCalls([&] {
    for (int i = 0; i < 300; ++i) mixer.Render(block);
  });
  EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
}

TEST(MixerRealtime, ControlStrikesHousekeepingAndRenderingRunAtOnce) {
  Mixer mixer({.most_banks = 16});
  std::atomic<bool> done{false};
  std::thread render([&] {
    std::vector<float> block(256);
    while (!done) {
      mixer.Render(block);
      for (const float x : block) ASSERT_LE(std::abs(x), 1.0F);
    }
  });
  std::thread housekeeping([&] {
    while (!done) {
      mixer.CollectGarbage();
      mixer.TakePeak();
      mixer.statistics();
    }
  });
  std::vector<std::thread> clients;
  clients.reserve(2);
  for (int client = 0; client < 2; ++client) {
    clients.emplace_back([&mixer] {
      const auto stream = mixer.OpenStream(64).value();
      for (int object = 0; object < 30;) {
        const auto bank = mixer.Add(MakeBank(-2000));
        if (!bank.ok()) continue;  // until the garbage has been collected
        for (uint64_t i = 0; i < 50; ++i) {
          stream->TryPush(
              {.bank = *bank, .frame = mixer.frame() + 10 * i, .action = MakeUnitImpulse()});
        }
        ++object % 2 == 0 ? mixer.LetRingOut(*bank) : mixer.FadeOut(*bank);
      }
    });
  }
  for (std::thread& client : clients) client.join();
  done = true;
  render.join();
  housekeeping.join();
  // All that was to leave has left once what rings has rung out: 60 blocks of 256 frames.
  std::vector<float> rest(60 * 256);
  mixer.Render(rest);
  mixer.CollectGarbage();
  EXPECT_EQ(mixer.statistics().bank_count, 0u);
  EXPECT_GT(mixer.statistics().accepted_count + mixer.statistics().late_count, 0u);
}

}  // namespace
}  // namespace carillon
