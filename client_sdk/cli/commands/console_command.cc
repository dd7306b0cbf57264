// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kLookPeriodS = 0.2;

/// A program that runs as long as the command, and the first line that it printed.
class Companion {
 public:
  /// Returns once the program has printed a line. Its errors go to stderr. Errors:
  /// Aborted (PROGRAM_ENDED).
  static absl::StatusOr<Companion> Start(const std::string& name, std::vector<std::string> words) {
    words.insert(words.begin(), PathOfCompanion(name));
    ASSIGN_OR_RETURN(Pipe output, Pipe::Make());
    absl::StatusOr<ChildProcess> child = ChildProcess::Start(
        {.words = words, .output = output.write_end(), .errors = STDERR_FILENO});
    output.CloseWriteEnd();
    Companion companion(std::move(output));
    if (child.ok()) {
      companion.child_.emplace(*std::move(child));
      char letter = 0;
      while (read(companion.output_.read_end(), &letter, 1) == 1 && letter != '\n') {
        companion.line_ += letter;
      }
    }
    if (!companion.line_.empty()) return companion;
    return Refusal(absl::StatusCode::kAborted, "PROGRAM_ENDED",
                   absl::StrCat(words.front(),
                                " did not start: see what it says above, or install "
                                "the package ",
                                name, " if it is missing"));
  }

  const std::string& line() const { return line_; }
  bool HasEnded() { return child_->Reap().has_value(); }

  void Stop() {
    child_->Kill(SIGTERM);
    child_->Wait();
  }

 private:
  explicit Companion(Pipe output) : output_(std::move(output)) {}

  Pipe output_;  // open, so that the program can go on printing
  std::optional<ChildProcess> child_;
  std::string line_;
};

/// Opens a browser at the address. The address has a secret, which the command line of a browser
/// would show to every user of the machine: it gets the path of a page that leads there. Returns
/// that page's path.
std::string OpenBrowser(const std::string& address) {
  std::string path = (fs::temp_directory_path() / "carillon-console-XXXXXX.html").string();
  const int file = mkstemps(path.data(), 5);
  if (file < 0) return "";
  const std::string page = absl::StrCat(
      "<!doctype html><meta http-equiv=\"refresh\" content=\"0; url=", address, "\">\n");
  const bool written = write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size());
  close(file);
  if (!written) return path;
  // Some openers last as long as their browser, which is to outlive this command.
  absl::StatusOr<ChildProcess> opener =
      ChildProcess::Start({.words = {"setsid", "--fork", "xdg-open", path}});
  if (opener.ok()) opener->Wait();
  return path;
}

bool HasDesktop() {
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

}  // namespace

std::string PathOfCompanion(const std::string& name) {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).replace_filename(name);
  return fs::exists(beside, error) ? beside.string() : name;
}

absl::Status RunConsole(const Program& program, const ConsoleOptions& options,
                        const StopSignal& stop) {
  absl::string_view socket = program.server;
  std::optional<Companion> daemon;
  if (absl::ConsumePrefix(&socket, "unix:") &&
      absl::IsUnavailable(program.Daemon()->IsServing("").status())) {
    std::error_code error;
    fs::create_directories(fs::path(std::string(socket)).parent_path(), error);
    ASSIGN_OR_RETURN(Companion started,
                     Companion::Start("carillond", {"--listen", program.server}));
    daemon.emplace(std::move(started));
    std::cerr << "started carillond, which ends with this command\n";
  }
  const absl::Cleanup stop_daemon = [&] {
    if (daemon) daemon->Stop();
  };
  ASSIGN_OR_RETURN(Companion console,
                   Companion::Start("carillon-console", {"--server", program.server, "--port",
                                                         absl::StrCat(options.port)}));
  if (program.json) {
    PrintJson({{"address", console.line()}});
  } else {
    std::cout << console.line() << std::endl;
  }
  std::string page;
  if (options.browser && HasDesktop()) page = OpenBrowser(console.line());
  const absl::Cleanup remove_page = [&] {
    if (!page.empty()) unlink(page.c_str());
  };
  while (!stop.ArrivesWithin(kLookPeriodS)) {
    if (!console.HasEnded()) continue;
    return Refusal(absl::StatusCode::kAborted, "PROGRAM_ENDED",
                   "carillon-console has ended: run the command again");
  }
  console.Stop();
  return absl::OkStatus();
}

}  // namespace carillon::cli
