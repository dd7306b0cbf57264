// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/run_in_child.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"

namespace carillon::precompute {
namespace {

bool WriteAll(int file, const std::string& bytes) {
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t n = write(file, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<size_t>(n);
  }
  return true;
}

absl::StatusOr<std::string> ReadAll(int file) {
  std::string bytes(static_cast<size_t>(lseek(file, 0, SEEK_END)), '\0');
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t n =
        pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return absl::InternalError("cannot read what the child wrote");
    done += static_cast<size_t>(n);
  }
  return bytes;
}

[[noreturn]] void BeChild(const std::function<std::string()>& work, int result,
                          std::chrono::seconds most_cpu) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit limit{static_cast<rlim_t>(most_cpu.count()), RLIM_INFINITY};
  setrlimit(RLIMIT_CPU, &limit);
  const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(null, STDOUT_FILENO);
  dup2(null, STDERR_FILENO);
  _exit(WriteAll(result, work()) ? 0 : 1);
}

}  // namespace

absl::StatusOr<std::string> RunInChild(const std::function<std::string()>& work,
                                       std::chrono::seconds most_cpu) {
  const int result = memfd_create("carillon-child", MFD_CLOEXEC);
  if (result < 0) return absl::InternalError(absl::StrCat("memfd_create: ", strerror(errno)));
  const absl::Cleanup close_result = [result] { close(result); };
  const pid_t child = fork();
  if (child < 0) return absl::InternalError(absl::StrCat("fork: ", strerror(errno)));
  if (child == 0) BeChild(work, result, most_cpu);
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return absl::InternalError(absl::StrCat("waitpid: ", strerror(errno)));
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    return absl::AbortedError(
        absl::StrCat("stopped after ", most_cpu.count(), " s of processor time"));
  }
  if (WIFSIGNALED(status)) {
    return absl::AbortedError(absl::StrCat("killed by signal ", WTERMSIG(status), " (",
                                           strsignal(WTERMSIG(status)), ")"));
  }
  if (WEXITSTATUS(status) != 0) {
    return absl::AbortedError(absl::StrCat("exited with status ", WEXITSTATUS(status)));
  }
  return ReadAll(result);
}

}  // namespace carillon::precompute
