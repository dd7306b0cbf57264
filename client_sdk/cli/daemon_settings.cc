// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/daemon_settings.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/daemon_process.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/program/escaped_text.h"

namespace carillon::cli {
namespace {

/// A check takes a tenth of a second.
constexpr char kLongestS[] = "10";
/// The exit status of carillond, if its settings are wrong.
constexpr int kWrongSettings = 2;
constexpr size_t kLongestOutput = 64 << 10;
/// The variables that decide about the settings of carillond, and none that could load a library.
constexpr auto kVariables =
    std::to_array<absl::string_view>({"CONFIGURATION_DIRECTORY=", "HOME=", "RUNTIME_DIRECTORY=",
                                      "STATE_DIRECTORY=", "XDG_RUNTIME_DIR=", "XDG_STATE_HOME="});

using Words = std::vector<std::string>;

/// Returns the program of a process, which may have been replaced by an upgrade, or nothing if it
/// is gone.
std::optional<std::string> ProgramFileOf(const std::string& folder) {
  std::error_code error;
  const std::string path = std::filesystem::read_symlink(folder + "/exe", error);
  if (error) return std::nullopt;
  const bool is_gone = absl::EndsWith(path, " (deleted)");
  if (!is_gone) return folder + "/exe";
  const std::string now(absl::StripSuffix(path, " (deleted)"));
  return std::filesystem::exists(now, error) ? std::optional(now) : std::nullopt;
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

std::optional<absl::Status> CheckSettingsOf(pid_t process) {
  const std::string folder = absl::StrCat("/proc/", process);
  const Words arguments = ArgumentsOf(process);
  // The program of another user must never run with the rights of this one.
  if (!IsOwn(process) || ProgramOf(process) != "carillond" || arguments.empty()) {
    return std::nullopt;
  }
  const std::optional<std::string> program = ProgramFileOf(folder);
  if (!program) return absl::FailedPreconditionError("its program is gone: install it again");
  Words words = {"timeout", kLongestS, "env", "-i"};
  for (const std::string& variable : EnvironmentOf(process)) {
    const auto begins = [&](absl::string_view name) { return absl::StartsWith(variable, name); };
    if (std::ranges::any_of(kVariables, begins)) words.push_back(variable);
  }
  words.push_back(*program);
  words.insert(words.end(), arguments.begin() + 1, arguments.end());
  words.push_back("--check-config");
  return Run(words, folder + "/cwd");
}

}  // namespace carillon::cli
