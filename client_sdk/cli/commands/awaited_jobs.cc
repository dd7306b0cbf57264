// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/awaited_jobs.h"

#include <csignal>
#include <cstdlib>

#include "absl/strings/str_format.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"

namespace carillon::cli {

AwaitedJobs::AwaitedJobs(const client::Client& daemon, const StopSignal& stop)
    : daemon_(daemon),
      stop_(stop),
      listener_([this](const std::stop_token& end) { Listen(end); }) {}

void AwaitedJobs::Add(const std::string& name) {
  const absl::MutexLock lock(&mutex_);
  names_.insert(name);
}

absl::StatusOr<v1::Job> AwaitedJobs::Await(const std::string& name) {
  absl::StatusOr<v1::Job> job = WatchWithProgress(daemon_, name);
  if (ends_) listener_.join();  // which ends the program
  const absl::MutexLock lock(&mutex_);
  names_.erase(name);
  return job;
}

void AwaitedJobs::Listen(const std::stop_token& end) {
  constexpr double kLookPeriodS = 0.02;
  while (!end.stop_requested()) {
    if (const int signal = stop_.ArrivesWithin(kLookPeriodS); signal > 0) EndBy(signal);
  }
}

void AwaitedJobs::EndBy(int signal) {
  ends_ = true;
  stop_.Release();  // so that another signal ends the program at once
  std::set<std::string> names;
  {
    const absl::MutexLock lock(&mutex_);
    names = names_;
  }
  for (const std::string& name : names) daemon_.WithdrawFromJob(name).status().IgnoreError();
  if (!names.empty()) {
    absl::FPrintF(stderr, "\ncarillon: stopped; the daemon computes %s no more for this command\n",
                  Counted(names.size(), "job"));
  }
  (void)raise(signal);
  std::_Exit(128 + signal);  // as a shell tells a signal, if the program ignores it
}

}  // namespace carillon::cli
