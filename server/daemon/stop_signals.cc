// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/stop_signals.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;

constexpr unsigned kStopLimitS = 4;
constexpr milliseconds kReloadPeriod(1000);
constexpr std::string_view kStopsStart = "stopping on a signal before the start was complete\n";
constexpr std::string_view kStopTooLong =
    "calls still run 4 s after the signal to stop, and are cut off\n";

std::atomic<bool> start_is_complete = false;
/// The handlers write the number of each signal into this pipe as a byte.
std::array<int, 2> pipe_of_signals{-1, -1};

/// Ends the process from a handler, which may neither lock nor allocate.
[[noreturn]] void EndNow(std::string_view line) {
  [[maybe_unused]] const ssize_t ignored = write(STDERR_FILENO, line.data(), line.size());
  std::_Exit(EXIT_SUCCESS);
}

void PassOn(int signal_number) {
  if (!start_is_complete && signal_number != SIGHUP) EndNow(kStopsStart);
  const int error = errno;
  const auto byte = static_cast<unsigned char>(signal_number);
  // A full pipe has signals enough.
  [[maybe_unused]] const ssize_t ignored = write(pipe_of_signals[1], &byte, 1);
  errno = error;
}

void CutOff(int /*signal_number*/) { EndNow(kStopTooLong); }

void Handle(int signal_number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(signal_number, &action, nullptr);
}

/// Returns the next signal, or 0 if none comes within the time.
int NextSignal(milliseconds time) {
  pollfd awaited{.fd = pipe_of_signals[0], .events = POLLIN, .revents = 0};
  poll(&awaited, 1, static_cast<int>(std::max(time.count(), milliseconds::rep{0})));
  unsigned char byte = 0;
  return read(pipe_of_signals[0], &byte, 1) == 1 ? byte : 0;
}

}  // namespace

void HandleSignals() {
  // Without descriptors the start fails soon by itself.
  [[maybe_unused]] const int ignored = pipe2(pipe_of_signals.data(), O_CLOEXEC | O_NONBLOCK);
  for (const int signal_number : {SIGINT, SIGTERM, SIGQUIT, SIGHUP}) Handle(signal_number, PassOn);
  // A timer may have been set by the program that has started this one. Writing beyond a file-size
  // limit fails like a full disk once SIGXFSZ is ignored.
  for (const int signal_number : {SIGUSR1, SIGUSR2, SIGALRM, SIGPIPE, SIGXFSZ}) {
    signal(signal_number, SIG_IGN);
  }
}

void CompleteStart() { start_is_complete = true; }

void WaitForStop(const std::function<void()>& reload, const StopLog& log,
                 const RepeatedWork& repeated) {
  using SteadyClock = std::chrono::steady_clock;
  constexpr auto kNever = SteadyClock::time_point::max();
  SteadyClock::time_point next_work = SteadyClock::now() + repeated.period;
  SteadyClock::time_point next_reload = kNever;
  SteadyClock::time_point last_reload{};
  int received = 0;
  while (received == 0 || received == SIGHUP) {
    const auto wait = std::min(next_work, next_reload) - SteadyClock::now();
    received = NextSignal(std::chrono::ceil<milliseconds>(wait));
    const SteadyClock::time_point now = SteadyClock::now();
    if (received == SIGHUP) next_reload = std::max(now, last_reload + kReloadPeriod);
    if (now >= next_reload) {
      reload();
      last_reload = now;
      next_reload = kNever;
    }
    if (now >= next_work) {
      repeated.work();
      next_work = now + repeated.period;
    }
  }
  log(absl::StrCat("stopping on SIG", sigabbrev_np(received)));
  Handle(SIGALRM, CutOff);
  alarm(kStopLimitS);
}

}  // namespace carillon
