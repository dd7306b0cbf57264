// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/running_daemon.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/algorithm/container.h"
#include "absl/cleanup/cleanup.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;

using Words = std::vector<std::string>;

/// A check takes a tenth of a second.
constexpr char kLongestS[] = "10";
/// The exit status of carillond, if its settings are wrong.
constexpr int kWrongSettings = 2;
constexpr size_t kLongestOutput = 64 << 10;
/// The variables that decide about the settings of carillond, and none that could load a library.
constexpr auto kVariables =
    std::to_array<absl::string_view>({"CONFIGURATION_DIRECTORY=", "HOME=", "RUNTIME_DIRECTORY=",
                                      "STATE_DIRECTORY=", "XDG_RUNTIME_DIR=", "XDG_STATE_HOME="});

std::string WhatToDo(int error) {
  switch (error) {
    case ENOENT:
      return "start carillond, or name its address with --server or CARILLON_SERVER";
    case ECONNREFUSED:
      return "the daemon has died: start carillond again";
    case EACCES:
    case EPERM:
      return "this user may not use the socket: for a daemon of the system, join the group "
             "carillon and log in again";
    case EAGAIN:
      return "the process there is stopped or hangs: end it, and start carillond again";
    default:
      return "see the address and its folder";
  }
}

std::string Read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns the texts in a file of /proc, in which each text ends with a zero byte.
Words ReadWords(const fs::path& path) {
  const std::string words = Read(path);
  if (words.empty()) return {};
  return absl::StrSplit(absl::StripSuffix(words, absl::string_view("\0", 1)), '\0');
}

/// Returns whether the process is a carillond whose real, effective, saved and file-system users
/// are all this user. The users of a program with the set-user-ID bit differ, and the program of
/// another user must never run with the rights of this one.
bool IsOwnDaemon(const fs::path& folder) {
  const std::string own = absl::StrJoin(std::vector<uid_t>(4, geteuid()), "\t");
  const Words lines = absl::StrSplit(Read(folder / "status"), '\n');
  return absl::c_linear_search(lines, absl::StrCat("Uid:\t", own)) &&
         Read(folder / "comm") == "carillond\n";
}

/// Returns the program of a process, which may have been replaced by an upgrade, or nothing if it
/// is gone.
std::optional<std::string> ProgramFileOf(const fs::path& folder) {
  std::error_code error;
  const std::string path = fs::read_symlink(folder / "exe", error);
  if (error) return std::nullopt;
  if (!absl::EndsWith(path, " (deleted)")) return (folder / "exe").string();
  const std::string now(absl::StripSuffix(path, " (deleted)"));
  return fs::exists(now, error) ? std::optional(now) : std::nullopt;
}

/// Returns the message of the error that carillond has printed.
std::string MessageIn(const std::string& output) {
  const std::pair<std::string, std::string> parts =
      absl::StrSplit(output, absl::MaxSplits(" error: ", 1));
  return EscapedText(
      std::string(absl::StripAsciiWhitespace(parts.second.empty() ? output : parts.second)));
}

/// Runs a check of the settings. A check that does not end in time, or ends otherwise than
/// carillond does, tells nothing.
std::optional<absl::Status> Run(const Words& words, const std::string& folder) {
  absl::StatusOr<Pipe> errors = Pipe::Make();
  if (!errors.ok() || !errors->DoNotWait().ok()) return std::nullopt;
  absl::StatusOr<ChildProcess> check =
      ChildProcess::Start({.words = words, .errors = errors->write_end(), .folder = folder});
  if (!check.ok()) return std::nullopt;
  errors->CloseWriteEnd();
  // The pipe is not read to its end, which a child of the check could put off.
  const ProcessEnd end = check->Wait();
  if (end.exited && end.status == 0) return absl::OkStatus();
  const std::string message = MessageIn(errors->Read(kLongestOutput));
  if (!end.exited || end.status != kWrongSettings || message.empty()) return std::nullopt;
  return absl::FailedPreconditionError(message);
}

}  // namespace

absl::StatusOr<pid_t> ProcessAt(const std::string& socket_path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  socket_path.copy(name.sun_path, sizeof(name.sun_path) - 1);
  const int made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const absl::Cleanup close_socket = [made] { close(made); };
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (connect(made, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 &&
      getsockopt(made, SOL_SOCKET, SO_PEERCRED, &credentials, &size) == 0) {
    return credentials.pid;
  }
  const int error = errno;
  return Refusal(absl::StatusCode::kUnavailable, "SERVER_UNAVAILABLE",
                 absl::StrCat("nobody takes connections at ", socket_path, " (",
                              std::generic_category().message(error), "): ", WhatToDo(error)));
}

std::optional<absl::Status> CheckSettingsOf(pid_t process) {
  const fs::path folder = absl::StrCat("/proc/", process);
  const Words arguments = ReadWords(folder / "cmdline");
  if (!IsOwnDaemon(folder) || arguments.empty()) return std::nullopt;
  const std::optional<std::string> program = ProgramFileOf(folder);
  if (!program) return absl::FailedPreconditionError("its program is gone: install it again");
  Words words = {"timeout", kLongestS, "env", "-i"};
  for (const std::string& variable : ReadWords(folder / "environ")) {
    const auto begins = [&](absl::string_view name) { return absl::StartsWith(variable, name); };
    if (std::ranges::any_of(kVariables, begins)) words.push_back(variable);
  }
  words.push_back(*program);
  words.insert(words.end(), arguments.begin() + 1, arguments.end());
  words.push_back("--check-config");
  return Run(words, folder / "cwd");
}

}  // namespace carillon::cli
