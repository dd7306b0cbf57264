// SPDX-License-Identifier: Apache-2.0
// watch_standstills LEAST_MS: until standard input ends, a thread on each core, of a higher
// real-time priority than any sound server has, notes when it woke late by LEAST_MS or more: then
// the core itself was not there, as a virtual machine's is not now and then, and nothing that
// waited for it could be in time. Says "watching" once it does, and in the end when that was, in
// seconds of the monotonic clock.
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <thread>
#include <utility>
#include <vector>

namespace carillon {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::chrono::milliseconds kPeriod{1};

struct Standstill {
  double begin_s = 0, end_s = 0;
};

/// Of one core.
struct Watch {
  std::vector<Standstill> found;
  bool realtime = false;
};

bool BecomeFirst(int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(core, &cores);
  const sched_param highest{.sched_priority = sched_get_priority_max(SCHED_FIFO)};
  return pthread_setaffinity_np(pthread_self(), sizeof(cores), &cores) == 0 &&
         pthread_setschedparam(pthread_self(), SCHED_FIFO, &highest) == 0;
}

void WatchCore(int core, Seconds least, const std::atomic<bool>& stopped, Watch& watch) {
  watch.realtime = BecomeFirst(core);
  auto due = Clock::now();
  while (!stopped) {
    due += kPeriod;
    std::this_thread::sleep_until(due);
    const auto now = Clock::now();
    if (now - due < least) continue;
    watch.found.push_back(
        {Seconds(due.time_since_epoch()).count(), Seconds(now.time_since_epoch()).count()});
    due = now;
  }
}

void Print(const std::vector<Watch>& watches) {
  const bool realtime = std::ranges::all_of(watches, &Watch::realtime);
  std::printf("{\"realtime\": %s, \"standstills\": [", realtime ? "true" : "false");
  const char* comma = "";
  for (const Watch& watch : watches) {
    for (const Standstill& each : watch.found) {
      std::printf("%s[%.4f, %.4f]", std::exchange(comma, ", "), each.begin_s, each.end_s);
    }
  }
  std::printf("]}\n");
}

int WatchAll(Seconds least) {
  mlockall(MCL_CURRENT | MCL_FUTURE);
  std::atomic<bool> stopped = false;
  std::vector<Watch> watches(std::thread::hardware_concurrency());
  std::vector<std::thread> threads;
  for (size_t core = 0; core < watches.size(); ++core) {
    threads.emplace_back(WatchCore, static_cast<int>(core), least, std::cref(stopped),
                         std::ref(watches[core]));
  }
  std::cout << "watching" << std::endl;
  char rest = 0;
  while (read(STDIN_FILENO, &rest, 1) > 0) {
  }
  stopped = true;
  for (std::thread& thread : threads) thread.join();
  Print(watches);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) {
  if (argc != 2) return EXIT_FAILURE;
  return carillon::WatchAll(carillon::Seconds(std::atof(argv[1]) / 1000));
}
