// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/child_process.h"

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr int kNice = 10;
constexpr int kEventDescriptor = 3;
constexpr int kAboveAllUsed = 10;

void Close(int& descriptor) {
  if (descriptor >= 0) close(descriptor);
  descriptor = -1;
}

struct Pipe {
  int read_end = -1;
  int write_end = -1;
  ~Pipe() {
    Close(read_end);
    Close(write_end);
  }
  bool Make() {
    std::array<int, 2> ends;
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return false;
    read_end = ends[0];
    write_end = ends[1];
    return fcntl(read_end, F_SETFL, O_NONBLOCK) == 0;
  }
};

absl::Status NotStarted() {
  const std::string why = std::generic_category().message(errno);
  return Refusal(absl::StatusCode::kResourceExhausted, "WORKER_NOT_STARTED",
                 absl::StrCat("the decomposing process cannot be started (", why,
                              "): free memory or processes and try again"));
}

// From here to exec in the child: other threads of the parent may hold any lock, so only calls that
// are safe in a signal handler.
void MakeFirstToBeKilled() {
  const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  [[maybe_unused]] const ssize_t written = write(file, "1000", 4);
  close(file);
}

void ResetSignals() {
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  signal(SIGPIPE, SIG_DFL);
  signal(SIGXFSZ, SIG_IGN);  // where a file may not grow, writing fails as on a full disk
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
}

bool ArrangeDescriptors(int events, int errors) {
  events = fcntl(events, F_DUPFD, kAboveAllUsed);
  errors = fcntl(errors, F_DUPFD, kAboveAllUsed);
  const int null = open("/dev/null", O_RDWR);
  const bool arranged = null >= 0 && dup2(null, STDIN_FILENO) >= 0 &&
                        dup2(null, STDOUT_FILENO) >= 0 && dup2(errors, STDERR_FILENO) >= 0 &&
                        dup2(events, kEventDescriptor) >= 0;
  close_range(kEventDescriptor + 1, ~0U, 0);
  return arranged;
}

// The last `count` processors of those that this process may use.
cpu_set_t LastProcessors(int count) {
  cpu_set_t usable;
  CPU_ZERO(&usable);
  sched_getaffinity(0, sizeof usable, &usable);
  cpu_set_t last;
  CPU_ZERO(&last);
  for (int i = CPU_SETSIZE - 1; i >= 0 && CPU_COUNT(&last) < count; --i) {
    if (CPU_ISSET(static_cast<size_t>(i), &usable)) CPU_SET(static_cast<size_t>(i), &last);
  }
  return last;
}

[[noreturn]] void RunInChild(pid_t parent, char* const* arguments, const cpu_set_t& processors,
                             int events, int errors) {
  constexpr int kNotExecuted = 127;
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNotExecuted);  // it died before the line above
  setpriority(PRIO_PROCESS, 0, kNice);
  sched_setaffinity(0, sizeof processors, &processors);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  MakeFirstToBeKilled();
  ResetSignals();
  if (ArrangeDescriptors(events, errors)) execv(arguments[0], arguments);
  _exit(kNotExecuted);
}

}  // namespace

absl::StatusOr<ChildProcess> ChildProcess::Spawn(const std::vector<std::string>& command,
                                                 int processor_count) {
  Pipe events;
  Pipe errors;
  if (!events.Make() || !errors.Make()) return NotStarted();
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  const cpu_set_t processors = LastProcessors(processor_count);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) return NotStarted();
  if (pid == 0)
    RunInChild(parent, arguments.data(), processors, events.write_end, errors.write_end);
  setpgid(pid, pid);  // as the child does: whichever comes first
  // By number: the header of glibc 2.36 cannot be used from C++.
  const int process = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  ChildProcess child(pid, process, std::exchange(events.read_end, -1),
                     std::exchange(errors.read_end, -1));
  if (process < 0) return NotStarted();
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      process_(std::exchange(other.process_, -1)),
      events_(std::exchange(other.events_, -1)),
      errors_(std::exchange(other.errors_, -1)) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    Kill();
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Close(process_);
  Close(events_);
  Close(errors_);
}

std::string ChildProcess::Read(int& descriptor, size_t limit) {
  std::string bytes;
  std::array<char, 4096> piece;
  while (descriptor >= 0 && bytes.size() < limit) {
    const ssize_t count = read(descriptor, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) break;
    if (count <= 0) {
      Close(descriptor);
    } else {
      bytes.append(piece.data(), static_cast<size_t>(count));
    }
  }
  return bytes;
}

void ChildProcess::Kill() {
  if (pid_ > 0) kill(-pid_, SIGKILL);
}

uint64_t ChildProcess::ResidentBytes() const {
  std::ifstream statm(absl::StrCat("/proc/", pid_, "/statm"));
  uint64_t total_pages = 0;
  uint64_t resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0;
  return resident_pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

std::optional<ProcessEnd> ChildProcess::Reap() {
  siginfo_t end{};
  const auto id = static_cast<id_t>(pid_);
  if (waitid(P_PID, id, &end, WEXITED | WNOHANG | WNOWAIT) == 0 && end.si_pid == 0) {
    return std::nullopt;
  }
  // Before reaping: until then nobody else can get the number of the group.
  Kill();
  const bool reaped = waitid(P_PID, id, &end, WEXITED) == 0;
  pid_ = -1;
  if (!reaped) return ProcessEnd{false, SIGCHLD};  // somebody ignores SIGCHLD: its end is unknown
  return ProcessEnd{end.si_code == CLD_EXITED, end.si_status};
}

}  // namespace carillon
