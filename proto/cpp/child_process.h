// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <csignal>
#include <cstddef>
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

/// A pipe that no child inherits by accident.
class Pipe {
 public:
  /// Errors: ResourceExhausted (WORKER_NOT_STARTED: no descriptors are left).
  static absl::StatusOr<Pipe> Make();
  Pipe(Pipe&& other) noexcept;
  Pipe& operator=(Pipe&&) = delete;
  ~Pipe();

  int read_end() const { return read_end_; }  ///< -1 once closed
  int write_end() const { return write_end_; }
  void CloseWriteEnd();

  /// Makes Read return at once if there is nothing to read.
  absl::Status DoNotWait();

  /// The bytes that can be read, at most `limit` or a few more. At the end of the data the read end
  /// is closed. Without DoNotWait, waits until the end or `limit`.
  std::string Read(size_t limit);

 private:
  Pipe(int read_end, int write_end) : read_end_(read_end), write_end_(write_end) {}

  int read_end_;
  int write_end_;
};

/// A command and the surroundings that it runs in. A descriptor of this process becomes one of the
/// child's; -1 stands for /dev/null. No other descriptor reaches the child.
struct ChildCommand {
  std::vector<std::string>
      words{};  ///< the program, found in PATH unless it has a slash; arguments
  int input = -1;
  int output = -1;
  int errors = -1;
  int events = -1;       ///< becomes descriptor 3; -1: the child has none
  std::string folder{};  ///< working directory; empty: the one of this process
  /// Above zero: a worker that yields to everything else. It leads a process group, which Kill
  /// ends as a whole; the kernel kills it when the thread that started it ends. It has nice 10, is
  /// the first to go when memory runs out, leaves no core file, and runs on the last processors, at
  /// most this many, of those that this process may use.
  int worker_processor_count = 0;
};

/// A child process, which is killed and waited for when the object is destroyed.
///
/// Neither Boost.Process nor posix_spawn starts it: Boost allocates memory between fork and exec,
/// and its pipe for errors reaches children that other threads start meanwhile; posix_spawn can
/// arrange no death signal, priority or processors.
class ChildProcess {
 public:
  /// Returns once the program runs. Errors: ResourceExhausted (WORKER_NOT_STARTED: no process or
  /// descriptor is left), FailedPrecondition (WORKER_NOT_FOUND: the program cannot be executed).
  static absl::StatusOr<ChildProcess> Start(const ChildCommand& command);

  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();

  /// Becomes readable when the process has ended.
  int descriptor() const { return descriptor_; }

  /// Sends a signal to the process, or to the whole group of a worker.
  void Kill(int signal_number = SIGKILL);

  /// Memory of the process in RAM, bytes; 0 once it has ended.
  uint64_t ResidentBytes() const;

  /// Whether the process has ended. If so, kills the rest of a worker's group and reaps the
  /// process.
  std::optional<ProcessEnd> Reap();

  /// Waits until the process has ended.
  ProcessEnd Wait();

 private:
  ChildProcess(pid_t pid, bool leads_group) : pid_(pid), leads_group_(leads_group) {}

  pid_t pid_;
  bool leads_group_;
  int descriptor_ = -1;
};

}  // namespace carillon
