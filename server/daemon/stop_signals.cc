// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/stop_signals.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr std::chrono::milliseconds kStopLimit(4000);
constexpr std::chrono::milliseconds kForever(-1);
constexpr timespec kReloadPeriod{.tv_sec = 1, .tv_nsec = 0};

sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal_number : {SIGINT, SIGTERM, SIGQUIT}) sigaddset(&signals, signal_number);
  return signals;
}

sigset_t ServedSignals() {
  sigset_t signals = StopSignals();
  sigaddset(&signals, SIGHUP);
  return signals;
}

int OpenStopSignals() {
  const sigset_t signals = StopSignals();
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

/// Returns the first of two descriptors that is readable, or -1 if none is within the time. The
/// second may be -1.
int Await(int first, int second, std::chrono::milliseconds time) {
  std::array<pollfd, 2> awaited{{{first, POLLIN, 0}, {second, POLLIN, 0}}};
  int count = 0;
  do {
    count = poll(awaited.data(), awaited.size(), static_cast<int>(time.count()));
  } while (count < 0);
  if (count == 0) return -1;
  return (awaited[0].revents & POLLIN) != 0 ? first : second;
}

}  // namespace

void BlockSignals() {
  const sigset_t signals = ServedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // A timer may have been set by the program that has started this one.
  for (const int signal_number : {SIGUSR1, SIGUSR2, SIGALRM, SIGPIPE}) {
    signal(signal_number, SIG_IGN);
  }
  signal(SIGXFSZ, SIG_IGN);  // writing beyond a file-size limit then fails like a full disk
}

StopGuard::StopGuard(StopLog log)
    : log_(std::move(log)),
      signals_(OpenStopSignals()),
      complete_(eventfd(0, EFD_CLOEXEC)),
      stopping_(eventfd(0, EFD_CLOEXEC)),
      ended_(eventfd(0, EFD_CLOEXEC)) {
  // Without descriptors the start fails soon by itself.
  if (std::min({signals_, complete_, stopping_, ended_}) < 0) return;
  thread_ = std::thread([this] { Run(); });
}

StopGuard::~StopGuard() {
  CompleteStart();
  eventfd_write(ended_, 1);
  if (thread_.joinable()) thread_.join();
  for (const int descriptor : {signals_, complete_, stopping_, ended_}) close(descriptor);
}

void StopGuard::CompleteStart() const { eventfd_write(complete_, 1); }

void StopGuard::BeginStop() const { eventfd_write(stopping_, 1); }

void StopGuard::Run() const {
  // WaitForStop takes a signal that comes with the end of the start, which is not read here.
  if (Await(complete_, signals_, kForever) == signals_) {
    EndNow("stopping on a signal before the start was complete");
  }
  if (Await(ended_, stopping_, kForever) == ended_) return;
  if (Await(ended_, -1, kStopLimit) == ended_) return;
  EndNow(absl::StrCat("calls still run ", kStopLimit.count(),
                      " ms after the signal to stop, and are cut off"));
}

void StopGuard::EndNow(const std::string& line) const {
  try {
    log_(line);
  } catch (const std::exception&) {
    // The process ends well also without the memory for a line.
  }
  std::_Exit(EXIT_SUCCESS);
}

void WaitForStop(const std::function<void()>& reload, const StopLog& log,
                 const RepeatedWork& repeated) {
  const sigset_t signals = ServedSignals();
  const sigset_t stops = StopSignals();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(repeated.period);
  const timespec period{.tv_sec = seconds.count(),
                        .tv_nsec = std::chrono::nanoseconds(repeated.period - seconds).count()};
  int received = 0;
  while (received <= 0) {
    received = sigtimedwait(&signals, nullptr, &period);
    if (received < 0 && errno == EAGAIN) repeated.work();
    if (received != SIGHUP) continue;
    reload();
    received = sigtimedwait(&stops, nullptr, &kReloadPeriod);
  }
  log(absl::StrCat("stopping on SIG", sigabbrev_np(received)));
}

}  // namespace carillon
