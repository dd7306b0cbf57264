// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// How a process ended: by its own exit status, or by a signal.
struct ProcessEnd {
  bool exited = false;
  int status = 0;  ///< exit status, or number of the signal
};

/// A program running in a process group of its own, nice 10, first in line when the kernel must
/// free memory, and killed by the kernel when the thread that spawned it ends. Its standard input
/// and output are /dev/null; its standard error and its descriptor 3 are pipes to here.
class ChildProcess {
 public:
  /// `command`: path of the program, then its arguments. It runs on the last `processor_count`
  /// processors that this process may use, so that the first ones are left to others.
  /// Errors: ResourceExhausted (WORKER_NOT_STARTED: no process or pipe to be had).
  static absl::StatusOr<ChildProcess> Spawn(const std::vector<std::string>& command,
                                            int processor_count);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  /// Kills the group and waits for the process, unless Reap has.
  ~ChildProcess();

  /// Becomes readable when the process has ended.
  int process_descriptor() const { return process_; }
  /// Non-blocking; -1 once closed.
  int event_descriptor() const { return events_; }
  int error_descriptor() const { return errors_; }

  /// What can be read now, at most `limit` bytes; closes the descriptor (sets it to -1) at its end.
  std::string ReadEvents(size_t limit) { return Read(events_, limit); }
  std::string ReadErrors(size_t limit) { return Read(errors_, limit); }

  void Kill();

  /// Memory of the process in RAM, bytes; 0 once it has ended.
  uint64_t ResidentBytes() const;

  /// Whether the process has ended; if so kills what is left of its group and reaps it.
  std::optional<ProcessEnd> Reap();

 private:
  ChildProcess(pid_t pid, int process, int events, int errors)
      : pid_(pid), process_(process), events_(events), errors_(errors) {}
  static std::string Read(int& descriptor, size_t limit);

  pid_t pid_;
  int process_;
  int events_;
  int errors_;
};

}  // namespace carillon
