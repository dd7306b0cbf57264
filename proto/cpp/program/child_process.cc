// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/program/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr size_t kEventDescriptor = 3;
constexpr int kFirstSpareDescriptor = 10;
constexpr int kNotExecuted = 127;  // the exit status that a shell gives

void Close(int& descriptor) {
  if (descriptor >= 0) close(descriptor);
  descriptor = -1;
}

absl::Status NotStarted(int error) {
  const std::string why = std::generic_category().message(error);
  return Refusal(absl::StatusCode::kResourceExhausted, "WORKER_NOT_STARTED",
                 absl::StrCat("a child process cannot be started (", why,
                              "): free memory or processes and try again"));
}

absl::Status NotExecuted(const std::string& program, int error) {
  const std::string why = std::generic_category().message(error);
  return Refusal(absl::StatusCode::kFailedPrecondition, "WORKER_NOT_FOUND",
                 absl::StrCat(program, " cannot be executed (", why,
                              "): install it, or name another program"));
}

/// The arguments and descriptors that the child uses between fork and exec, computed before the
/// fork.
struct Preparation {
  std::vector<char*> arguments{};
  std::vector<char*> environment{};
  std::array<int, 4> descriptors{};  // of this process, by their number in the child
  bool is_worker = false;
  int nice = 0;
  cpu_set_t processors{};
  pid_t parent = 0;
  int failure = -1;  // the write end of the pipe that tells why exec failed
};

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

/// The variables that a worker gets; the last ones are prefixes.
constexpr std::array kWorkerVariables = std::to_array<std::string_view>(
    {"PATH=", "HOME=", "TMPDIR=", "LD_LIBRARY_PATH=", "TZ=", "LANG=", "LC_", "OPENBLAS_", "OMP_",
     "ASAN_", "LSAN_", "TSAN_", "UBSAN_"});

std::vector<char*> EnvironmentFor(bool is_worker) {
  std::vector<char*> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    const std::string_view text(*variable);
    const bool kept = !is_worker || std::ranges::any_of(kWorkerVariables, [text](auto prefix) {
      return text.starts_with(prefix);
    });
    if (kept) variables.push_back(*variable);
  }
  variables.push_back(nullptr);
  return variables;
}

Preparation Prepare(const ChildCommand& command, int failure) {
  Preparation child;
  child.arguments.reserve(command.words.size() + 1);
  for (const std::string& word : command.words) {
    child.arguments.push_back(const_cast<char*>(word.c_str()));
  }
  child.arguments.push_back(nullptr);
  child.descriptors = {command.input, command.output, command.errors, command.events};
  child.is_worker = command.worker_processor_count > 0;
  child.nice = command.worker_nice;
  child.environment = EnvironmentFor(child.is_worker);
  child.processors = LastProcessors(command.worker_processor_count);
  child.parent = getpid();
  child.failure = failure;
  return child;
}

// From here to exec in the child, other threads of the parent may hold any lock, so only calls that
// are safe in a signal handler are allowed.
void BecomeFirstToBeKilled() {
  const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
  if (file < 0) return;
  [[maybe_unused]] const ssize_t written = write(file, "1000", 4);
  close(file);
}

void BecomeWorker(const Preparation& child) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != child.parent) _exit(kNotExecuted);  // the parent died before the line above
  setpriority(PRIO_PROCESS, 0, child.nice);
  sched_setaffinity(0, sizeof child.processors, &child.processors);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  BecomeFirstToBeKilled();
  signal(SIGXFSZ, SIG_IGN);  // a file that may not grow fails like a full disk
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
}

void ResetSignals() {
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  signal(SIGPIPE, SIG_DFL);
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
  signal(SIGCHLD, SIG_DFL);
}

// Copies the descriptors out of the way first, because one may have the number that another gets.
bool ArrangeDescriptors(std::array<int, 4> descriptors) {
  const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (size_t i = 0; i < kEventDescriptor; ++i) {
    if (descriptors[i] < 0) descriptors[i] = null;
  }
  for (int& descriptor : descriptors) {
    if (descriptor >= 0) descriptor = fcntl(descriptor, F_DUPFD_CLOEXEC, kFirstSpareDescriptor);
  }
  // Closed by exec, so that the pipe for its failure lives until then.
  close_range(kEventDescriptor, ~0U, CLOSE_RANGE_CLOEXEC);
  for (size_t i = 0; i <= kEventDescriptor; ++i) {
    const bool wanted = i < kEventDescriptor || descriptors[i] >= 0;
    if (wanted && dup2(descriptors[i], static_cast<int>(i)) < 0) return false;
  }
  return true;
}

[[noreturn]] void RunInChild(const Preparation& child) {
  const int failure = fcntl(child.failure, F_DUPFD_CLOEXEC, kFirstSpareDescriptor);
  if (child.is_worker) BecomeWorker(child);
  ResetSignals();
  if (ArrangeDescriptors(child.descriptors)) {
    // glibc's function allocates no memory.
    execvpe(child.arguments[0], child.arguments.data(), child.environment.data());
  }
  const int error = errno;
  [[maybe_unused]] const ssize_t written = write(failure, &error, sizeof error);
  _exit(kNotExecuted);
}

/// While a process ignores SIGCHLD, the kernel reaps its children before it can learn how they
/// ended.
void StopIgnoringChildren() {
  struct sigaction action {};
  if (sigaction(SIGCHLD, nullptr, &action) == 0 && action.sa_handler == SIG_IGN) {
    signal(SIGCHLD, SIG_DFL);
  }
}

/// Returns the state of a thread, a letter that proc(5) explains, or 0 if it cannot be read. The
/// name before the state may contain any character, also a bracket.
char StateOfThread(const std::filesystem::path& folder) {
  std::ifstream stat(folder / "stat");
  std::string line;
  std::getline(stat, line);
  const size_t name_end = line.rfind(") ");
  return name_end == std::string::npos ? '\0' : line[name_end + 2];
}

}  // namespace

absl::StatusOr<Pipe> Pipe::Make() {
  std::array<int, 2> ends;
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return NotStarted(errno);
  return Pipe(ends[0], ends[1]);
}

Pipe::Pipe(Pipe&& other) noexcept
    : read_end_(std::exchange(other.read_end_, -1)),
      write_end_(std::exchange(other.write_end_, -1)) {}

Pipe::~Pipe() {
  Close(read_end_);
  Close(write_end_);
}

void Pipe::CloseWriteEnd() { Close(write_end_); }

absl::Status Pipe::DoNotWait() {
  return fcntl(read_end_, F_SETFL, O_NONBLOCK) == 0 ? absl::OkStatus() : NotStarted(errno);
}

std::string Pipe::Read(size_t limit) {
  std::string bytes;
  std::array<char, 4096> piece;
  while (read_end_ >= 0 && bytes.size() < limit) {
    const ssize_t count = read(read_end_, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) break;
    if (count <= 0) {
      Close(read_end_);
    } else {
      bytes.append(piece.data(), static_cast<size_t>(count));
    }
  }
  return bytes;
}

absl::StatusOr<ChildProcess> ChildProcess::Start(const ChildCommand& command) {
  ASSIGN_OR_RETURN(Pipe failure, Pipe::Make());
  const Preparation prepared = Prepare(command, failure.write_end());
  StopIgnoringChildren();
  const pid_t pid = fork();
  if (pid < 0) return NotStarted(errno);
  if (pid == 0) RunInChild(prepared);
  failure.CloseWriteEnd();
  ChildProcess child(pid, prepared.is_worker);
  const std::string why = failure.Read(sizeof(int));  // empty: exec has closed the pipe
  if (why.size() == sizeof(int)) {
    int error = 0;
    why.copy(reinterpret_cast<char*>(&error), sizeof error);
    return NotExecuted(command.words[0], error);
  }
  // By number: the header of glibc 2.36 cannot be used from C++.
  child.descriptor_ = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  if (child.descriptor_ < 0) return NotStarted(errno);
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      leads_group_(other.leads_group_),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    Kill();
    while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Close(descriptor_);
}

void ChildProcess::Kill(int signal_number) {
  if (pid_ > 0) kill(leads_group_ ? -pid_ : pid_, signal_number);
}

uint64_t ChildProcess::ResidentBytes() const {
  std::ifstream statm(absl::StrCat("/proc/", pid_, "/statm"));
  uint64_t total_pages = 0;
  uint64_t resident_pages = 0;
  if (!(statm >> total_pages >> resident_pages)) return 0;
  return resident_pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

std::chrono::nanoseconds ChildProcess::ProcessorTime() const {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(pid_, &clock) != 0 || clock_gettime(clock, &time) != 0) return {};
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

bool ChildProcess::Sleeps() const {
  std::error_code error;
  bool sleeps = false;
  for (const auto& thread :
       std::filesystem::directory_iterator(absl::StrCat("/proc/", pid_, "/task"), error)) {
    const char state = StateOfThread(thread.path());
    if (state == 'R' || state == 'D') return false;
    sleeps = sleeps || state != '\0';
  }
  return sleeps;
}

std::optional<ProcessEnd> ChildProcess::Reap() {
  siginfo_t end{};
  const auto id = static_cast<id_t>(pid_);
  if (waitid(P_PID, id, &end, WEXITED | WNOHANG | WNOWAIT) == 0 && end.si_pid == 0) {
    return std::nullopt;
  }
  // This comes before the process is reaped, while no other process can get the group's number.
  if (leads_group_) Kill();
  waitid(P_PID, id, &end, WEXITED);
  pid_ = -1;
  return ProcessEnd{end.si_code == CLD_EXITED, end.si_status};
}

ProcessEnd ChildProcess::Wait() {
  pollfd ended{descriptor_, POLLIN, 0};
  while (true) {
    poll(&ended, 1, -1);
    if (const std::optional<ProcessEnd> end = Reap()) return *end;
  }
}

}  // namespace carillon
