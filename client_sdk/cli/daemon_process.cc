// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/daemon_process.h"

#include <poll.h>
#include <sched.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "absl/algorithm/container.h"
#include "absl/cleanup/cleanup.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;

std::string WhatToDo(int error) {
  switch (error) {
    case ENOENT:
      return "start carillond, or name its address with --server or CARILLON_SERVER";
    case ECONNREFUSED:
      return "the daemon has died: start carillond again";
    case EACCES:
    case EPERM:
      return "this user may not use the socket: for a daemon of the system, join the group "
             "carillon "
             "and log in again";
    case EAGAIN:
      return "it is stopped or hangs: end it, and start carillond again";
    default:
      return "see the address and its folder";
  }
}

/// Returns a socket that is connected to a Unix socket, or -1 with errno. EAGAIN: the process there
/// does not take the connections that wait already.
int Connected(const std::string& socket_path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  socket_path.copy(name.sun_path, sizeof(name.sun_path) - 1);
  const int made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (made < 0) return -1;
  if (connect(made, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0) return made;
  const int error = errno;
  close(made);
  errno = error;
  return -1;
}

std::string Read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the texts in a file of /proc, in which each text ends with a zero byte.
std::vector<std::string> ReadWords(pid_t process, const char* name) {
  const std::string words = Read(absl::StrCat("/proc/", process, "/", name));
  if (words.empty()) return {};
  return absl::StrSplit(absl::StripSuffix(words, absl::string_view("\0", 1)), '\0');
}

/// The scheduling policy in a thread's line of /proc; see proc(5).
std::optional<int> PolicyIn(const std::string& stat) {
  constexpr size_t kPolicyAfterName = 39;
  const std::vector<std::string> fields = absl::StrSplit(stat.substr(stat.rfind(')') + 1), ' ');
  int policy = 0;
  if (fields.size() <= kPolicyAfterName) return std::nullopt;
  if (!absl::SimpleAtoi(fields[kPolicyAfterName], &policy)) return std::nullopt;
  return policy;
}

}  // namespace

absl::StatusOr<pid_t> ProcessAt(const std::string& socket_path) {
  const int made = Connected(socket_path);
  const int error = errno;
  const absl::Cleanup close_socket = [made] { close(made); };
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (made >= 0 && getsockopt(made, SOL_SOCKET, SO_PEERCRED, &credentials, &size) == 0) {
    return credentials.pid;
  }
  return Refusal(
      absl::StatusCode::kUnavailable, "SERVER_UNAVAILABLE",
      absl::StrCat(error == EAGAIN ? "the process takes no connection at " : "nobody listens at ",
                   socket_path, " (", std::generic_category().message(error),
                   "): ", WhatToDo(error)));
}

std::string ProcessName(pid_t process) {
  // The kernel gives no number for a process of another PID namespace.
  if (process == 0) return "a process of another PID namespace";
  const std::string name = ProgramOf(process);
  return name.empty() ? absl::StrCat("process ", process)
                      : absl::StrCat(name, " (process ", process, ")");
}

std::string ProgramOf(pid_t process) {
  const std::string name = Read(absl::StrCat("/proc/", process, "/comm"));
  return std::string(absl::StripSuffix(name, "\n"));
}

std::vector<std::string> ArgumentsOf(pid_t process) { return ReadWords(process, "cmdline"); }

std::vector<std::string> EnvironmentOf(pid_t process) { return ReadWords(process, "environ"); }

bool IsOwn(pid_t process) {
  const std::string own = absl::StrJoin(std::vector<uid_t>(4, geteuid()), "\t");
  const std::vector<std::string> lines =
      absl::StrSplit(Read(absl::StrCat("/proc/", process, "/status")), '\n');
  return absl::c_linear_search(lines, absl::StrCat("Uid:\t", own));
}

bool IsMute(const std::string& socket_path, std::chrono::milliseconds time) {
  const int made = Connected(socket_path);
  if (made < 0) return errno == EAGAIN;
  const absl::Cleanup close_socket = [made] { close(made); };
  pollfd awaited{made, POLLIN, 0};
  return poll(&awaited, 1, static_cast<int>(time.count())) == 0;
}

std::optional<bool> HasRealtimeThread(pid_t process) {
  std::optional<bool> found;
  std::error_code error;
  for (const auto& thread :
       fs::directory_iterator(absl::StrCat("/proc/", process, "/task"), error)) {
    const std::optional<int> policy = PolicyIn(Read(thread.path() / "stat"));
    if (policy) found = found.value_or(false) || *policy == SCHED_FIFO || *policy == SCHED_RR;
  }
  return found;
}

std::optional<uint64_t> DescriptorLimit(pid_t process) {
  for (const absl::string_view line :
       absl::StrSplit(Read(absl::StrCat("/proc/", process, "/limits")), '\n')) {
    const std::vector<std::string> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
    if (words.size() < 4 || words[1] != "open" || words[2] != "files") continue;
    uint64_t limit = std::numeric_limits<uint64_t>::max();
    return words[3] == "unlimited" || absl::SimpleAtoi(words[3], &limit) ? std::optional(limit)
                                                                         : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace carillon::cli
