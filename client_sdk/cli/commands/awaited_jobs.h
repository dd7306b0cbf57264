// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <set>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "carillon/client.h"
#include "client_sdk/cli/commands/stop_signal.h"

namespace carillon::cli {

/// The jobs that a command asks for and awaits. If a signal stops the command, the command
/// withdraws from those that have not ended, so that the daemon does not compute them for nobody,
/// and the program ends as the signal ends it. Jobs that other clients have asked for, too, go on.
class AwaitedJobs {
 public:
  /// `daemon` and `stop` must outlive this.
  AwaitedJobs(const client::Client& daemon, const StopSignal& stop);

  const client::Client& daemon() const { return daemon_; }

  /// Notes a job that was asked for.
  void Add(const std::string& name);

  /// Waits until a job ends, as WatchWithProgress.
  absl::StatusOr<v1::Job> Await(const std::string& name);

 private:
  void Listen(const std::stop_token& end);
  [[noreturn]] void EndBy(int signal);

  const client::Client& daemon_;
  const StopSignal& stop_;
  absl::Mutex mutex_;
  std::set<std::string> names_ ABSL_GUARDED_BY(mutex_);
  std::atomic<bool> ends_{false};
  std::jthread listener_;  // the last member, because it uses the others
};

}  // namespace carillon::cli
