// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/daemon_settings.h"

#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/daemon_process.h"
#include "proto/cpp/child_process.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

/// A check takes a tenth of a second.
constexpr char kLongestS[] = "10";
/// The exit status of carillond, if its settings are wrong.
constexpr int kWrongSettings = 2;
constexpr size_t kLongestOutput = 64 << 10;

/// Returns the words before a program that let it run as `user`, or nothing if this user may not do
/// that. The program of a daemon must not run with the rights or the environment of root.
std::optional<std::vector<std::string>> WordsToRunAs(uid_t user) {
  std::vector<std::string> words = {"timeout", kLongestS};
  if (user == geteuid()) return words;
  if (geteuid() != 0) return std::nullopt;
  for (const std::string& word :
       {std::string("setpriv"), absl::StrCat("--reuid=", user), std::string("--init-groups"),
        std::string("--reset-env"), std::string("--no-new-privs")}) {
    words.push_back(word);
  }
  return words;
}

/// Returns the message of the last error that carillond has printed.
std::string LastError(const std::string& output) {
  const std::pair<std::string, std::string> parts =
      absl::StrSplit(output, absl::MaxSplits(" error: ", 1));
  return std::string(absl::StripAsciiWhitespace(parts.second.empty() ? output : parts.second));
}

}  // namespace

std::optional<absl::Status> CheckSettingsOf(pid_t process) {
  const std::string folder = absl::StrCat("/proc/", process);
  struct stat owner {};
  if (ProgramOf(process) != "carillond" || stat(folder.c_str(), &owner) != 0) return std::nullopt;
  auto words = WordsToRunAs(owner.st_uid);
  const std::vector<std::string> arguments = ArgumentsOf(process);
  absl::StatusOr<Pipe> errors = Pipe::Make();
  if (!words || arguments.empty() || !errors.ok()) return std::nullopt;
  words->push_back(folder + "/exe");
  words->insert(words->end(), arguments.begin() + 1, arguments.end());
  words->push_back("--check-config");
  absl::StatusOr<ChildProcess> check = ChildProcess::Start(
      {.words = *words, .errors = errors->write_end(), .folder = folder + "/cwd"});
  if (!check.ok()) return std::nullopt;
  errors->CloseWriteEnd();
  const std::string output = errors->Read(kLongestOutput);
  const ProcessEnd end = check->Wait();
  if (!end.exited || (end.status != 0 && end.status != kWrongSettings)) return std::nullopt;
  if (end.status == 0) return absl::OkStatus();
  return absl::FailedPreconditionError(LastError(output));
}

}  // namespace carillon::cli
