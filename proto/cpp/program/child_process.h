// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// The end of a process, by its own exit status or by a signal.
struct ProcessEnd {
  bool exited = false;
  int status = 0;  ///< exit status, or number of the signal
};

/// A pipe that no child inherits by accident.
class Pipe {
 public:
  /// Errors: ResourceExhausted (WORKER_NOT_STARTED: no descriptors are left).
  static absl::StatusOr<Pipe> Make();
  Pipe(Pipe&& other) noexcept;
  Pipe& operator=(Pipe&&) = delete;
  ~Pipe();

  int read_end() const { return read_end_; }  ///< -1 once it is closed
  int write_end() const { return write_end_; }
  void CloseWriteEnd();

  /// Makes Read return at once if there is nothing to read.
  absl::Status DoNotWait();

  /// Returns the bytes that can be read, at most `limit` or a few more. At the end of the data,
  /// closes the read end. Without DoNotWait, waits until the end or `limit`.
  std::string Read(size_t limit);

 private:
  Pipe(int read_end, int write_end) : read_end_(read_end), write_end_(write_end) {}

  int read_end_;
  int write_end_;
};

/// A command and the environment in which it runs. The child inherits the descriptors that are
/// named here, and no other. -1 stands for /dev/null.
struct ChildCommand {
  std::vector<std::string>
      words{};  ///< the program, found in PATH unless it has a slash, and its arguments
  int input = -1;
  int output = -1;
  int errors = -1;
  int events = -1;  ///< becomes descriptor 3; -1 if the child has none
  /// If above zero, the child is a worker that yields to everything else. It leads a process group,
  /// which Kill ends as a whole. The kernel kills it when the thread that started it ends. It has
  /// the niceness `worker_nice`, is the first process killed when memory runs out, and leaves no
  /// core file. It runs on this number of processors at most, the last ones that this process may
  /// use. It gains no privileges by programs that it executes. From the environment it gets only
  /// the paths, the locale, and the settings of OpenBLAS, OpenMP and the sanitizers.
  int worker_processor_count = 0;
  int worker_nice = 10;
};

/// A child process, which is killed and waited for when the object is destroyed.
///
/// Our own code starts the process, because Boost.Process allocates memory between fork and exec,
/// and its pipe for errors reaches children that other threads start meanwhile. posix_spawn cannot
/// set a death signal, priority or processors.
class ChildProcess {
 public:
  /// Starts the program and returns once it runs. If this process ignores SIGCHLD, which it
  /// inherits from a parent that does, the call ends that, because the ends of children would be
  /// lost. Errors: ResourceExhausted (WORKER_NOT_STARTED: no process or descriptor is left),
  /// FailedPrecondition (WORKER_NOT_FOUND: the program cannot be executed).
  static absl::StatusOr<ChildProcess> Start(const ChildCommand& command);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();

  /// Returns a descriptor that becomes readable when the process has ended.
  int descriptor() const { return descriptor_; }

  /// Sends a signal to the process, or to the whole group of a worker.
  void Kill(int signal_number = SIGKILL);

  /// Returns the memory of the process in RAM, bytes, or 0 once it has ended.
  uint64_t ResidentBytes() const;

  /// Returns the processor time that all threads of the process have used, or 0 once it has ended.
  std::chrono::nanoseconds ProcessorTime() const;

  /// Returns whether every thread of the process waits for an event, and none for a processor or
  /// the disk. A process whose threads cannot be read does not sleep.
  bool Sleeps() const;

  /// Returns the end of the process, if it has ended. It then also kills the rest of a worker's
  /// group and reaps the process.
  std::optional<ProcessEnd> Reap();

  /// Waits until the process has ended, and returns its end.
  ProcessEnd Wait();

 private:
  ChildProcess(pid_t pid, bool leads_group) : pid_(pid), leads_group_(leads_group) {}

  pid_t pid_;
  bool leads_group_;
  int descriptor_ = -1;
};

}  // namespace carillon
