// SPDX-License-Identifier: Apache-2.0
#include "server/stop_signals.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr std::chrono::milliseconds kStopLimit(4500);
constexpr timespec kReloadPeriod{.tv_sec = 1, .tv_nsec = 0};

sigset_t StopSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal_number : {SIGINT, SIGTERM}) sigaddset(&signals, signal_number);
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

}  // namespace

void BlockSignals() {
  const sigset_t signals = ServedSignals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  for (const int signal_number : {SIGUSR1, SIGUSR2}) signal(signal_number, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);  // writing beyond a file-size limit then fails like a full disk
}

StartGuard::StartGuard(StopLog log)
    : log_(std::move(log)), signals_(OpenStopSignals()), complete_(eventfd(0, EFD_CLOEXEC)) {
  // Without descriptors the start fails soon by itself.
  if (signals_ >= 0 && complete_ >= 0) thread_ = std::thread([this] { Run(); });
}

StartGuard::~StartGuard() {
  Complete();
  close(signals_);
  close(complete_);
}

void StartGuard::Complete() {
  eventfd_write(complete_, 1);
  if (thread_.joinable()) thread_.join();
}

void StartGuard::Run() const {
  std::array<pollfd, 2> awaited{{{complete_, POLLIN, 0}, {signals_, POLLIN, 0}}};
  while (poll(awaited.data(), awaited.size(), -1) < 0) {
  }
  // WaitForStop takes a signal that comes with the end of the start, which was not read here.
  if ((awaited[0].revents & POLLIN) != 0) return;
  log_("stopping on a signal before the start was complete");
  std::_Exit(EXIT_SUCCESS);
}

void WaitForStop(const std::function<void()>& reload, const StopLog& log) {
  const sigset_t signals = ServedSignals();
  const sigset_t stops = StopSignals();
  int received = 0;
  while (received <= 0) {
    if (sigwait(&signals, &received) != 0) received = 0;
    if (received != SIGHUP) continue;
    reload();
    received = sigtimedwait(&stops, nullptr, &kReloadPeriod);
  }
  log(absl::StrCat("stopping on ", received == SIGINT ? "SIGINT" : "SIGTERM"));
}

void LimitStop(StopLog log) {
  std::thread([log = std::move(log)] {
    std::this_thread::sleep_for(kStopLimit);
    log(absl::StrCat("calls still run ", kStopLimit.count(),
                     " ms after the signal to stop, and are cut off"));
    std::_Exit(EXIT_SUCCESS);
  }).detach();
}

}  // namespace carillon
