// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace carillon {

/// Takes a line for the log.
using StopLog = std::function<void(const std::string&)>;

/// Handles the signals that the daemon acts on, and ignores those that must not end it. A signal to
/// stop (SIGINT, SIGTERM, SIGQUIT) ends the process at once until CompleteStart, whatever the start
/// waits for. Nothing that was acknowledged is lost: the database is written as for a loss of
/// power.
void HandleSignals();

/// The start is complete. From then on WaitForStop takes the signals.
void CompleteStart();

/// Work that is done again and again while WaitForStop waits.
struct RepeatedWork {
  std::chrono::milliseconds period;
  std::function<void()> work;
};

/// Returns on a signal to stop. The process ends if its stop then takes longer than 4 s, for
/// instance because a call computes. SIGHUP calls `reload`, but at most once a second: signals that
/// come sooner cause one call together.
void WaitForStop(const std::function<void()>& reload, const StopLog& log,
                 const RepeatedWork& repeated);

}  // namespace carillon
