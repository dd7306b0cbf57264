// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client_sdk/cli/commands.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

using std::chrono::steady_clock;

constexpr int kEventDescriptor = 3;
constexpr int kSignalled = 128;  // what a shell adds to the number of a signal
constexpr int kNotFound = 127;   // as a shell has it
constexpr auto kPatience = std::chrono::minutes(10);
constexpr auto kBetweenReports = std::chrono::seconds(1);
constexpr double kFirstPause_s = 0.5;
constexpr double kLongestPause_s = 10;

absl::Status Stopped() {
  return Refusal(absl::StatusCode::kCancelled, "RUN_STOPPED",
                 "the run was told to stop and brings no result: none needed");
}

/// A folder of this run alone, gone with it.
class RunFolder {
 public:
  static absl::StatusOr<RunFolder> Make() {
    const char* const temporary = std::getenv("TMPDIR");
    std::string path =
        absl::StrCat(temporary == nullptr ? "/tmp" : temporary, "/carillon-run-XXXXXX");
    if (mkdtemp(path.data()) != nullptr) return RunFolder(path);
    return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat(path, " cannot be made: name a folder with room in $TMPDIR"));
  }
  RunFolder(RunFolder&& other) noexcept { path_.swap(other.path_); }
  RunFolder& operator=(RunFolder&&) = delete;
  ~RunFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }

  std::string File(const char* name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit RunFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

/// Calls again while no daemon answers: it may be starting anew.
absl::Status Patiently(const StopSignal& stop, const std::function<absl::Status()>& call) {
  const auto deadline = steady_clock::now() + kPatience;
  for (double pause_s = kFirstPause_s;; pause_s = std::min(2 * pause_s, kLongestPause_s)) {
    absl::Status status = call();
    const bool silent = absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status);
    if (!silent || steady_clock::now() > deadline) return status;
    if (stop.ArrivesWithin(pause_s)) return Stopped();
  }
}

/// Starts the command in the folder, with `events` as its descriptor 3; -1 where it cannot.
pid_t Spawn(const std::vector<std::string>& command, const RunFolder& folder, int events) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, events, kEventDescriptor);
  posix_spawn_file_actions_addchdir_np(&actions, folder.path().c_str());
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  pid_t child = -1;
  const int error =
      posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error == 0 ? child : -1;
}

/// Reads what the command reports until it ends: its error, if any; progress is passed on.
void FollowEvents(int descriptor, v1::RunEnd& end,
                  const std::function<void(const v1::Progress&)>& on_progress) {
  google::protobuf::io::FileInputStream in(descriptor);
  auto reported = steady_clock::now() - kBetweenReports;
  v1::WorkerEvent event;
  bool at_end = false;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&event, &in, &at_end)) {
    if (event.has_error()) *end.mutable_error() = event.error();
    if (event.has_progress() && steady_clock::now() - reported >= kBetweenReports) {
      on_progress(event.progress());
      reported = steady_clock::now();
    }
    event.Clear();
  }
  if (at_end || end.has_error()) return;
  *end.mutable_error() = ToErrorInfo(
      Refusal(absl::StatusCode::kDataLoss, "WORKER_GARBAGE",
              "the decomposing process wrote to its event pipe what is no event: this is a fault "
              "in it; report it with the mesh"));
}

std::string HostName() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "the node";
}

int ExitStatusOf(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
}

absl::StatusOr<v1::RunEnd> RunToEnd(const std::vector<std::string>& command,
                                    const RunFolder& folder, const StopSignal& stop,
                                    const std::function<void(const v1::Progress&)>& on_progress) {
  std::array<int, 2> ends{-1, -1};
  const pid_t child =
      pipe2(ends.data(), O_CLOEXEC) == 0 ? Spawn(command, folder, ends[1]) : pid_t{-1};
  close(ends[1]);
  v1::RunEnd end;
  if (child < 0) {
    close(ends[0]);
    end.set_exit_status(kNotFound);
    *end.mutable_error() =
        ToErrorInfo(Refusal(absl::StatusCode::kFailedPrecondition, "WORKER_NOT_FOUND",
                            absl::StrCat(command.front(), " cannot be started on ", HostName(),
                                         ": install it there, or name another with --precompute")));
    return end;
  }
  std::atomic<bool> stopped = false;
  std::jthread watch([&](const std::stop_token& over) {
    while (!over.stop_requested()) {
      if (!stop.ArrivesWithin(0.1)) continue;
      stopped = true;
      kill(child, SIGTERM);
      return;
    }
  });
  FollowEvents(ends[0], end, on_progress);
  close(ends[0]);
  watch.request_stop();
  watch.join();
  end.set_exit_status(ExitStatusOf(child));
  // Else the end of a run that was told to stop would look like a crash.
  if (stopped || stop.ArrivesWithin(0)) return Stopped();
  return end;
}

}  // namespace

absl::Status RunJob(const client::Client& daemon, const RunJobOptions& options,
                    const StopSignal& stop) {
  unsetenv("CARILLON_JOB_TOKEN");  // of no use to the command
  const client::JobRun run{.job = absl::StrCat("jobs/", options.digest), .token = options.token};
  const absl::StatusOr<RunFolder> folder = RunFolder::Make();
  if (!folder.ok()) return folder.status();
  absl::Status fetched =
      Patiently(stop, [&] { return daemon.FetchMesh(run, folder->File("mesh")); });
  if (!fetched.ok()) return fetched;
  const absl::StatusOr<v1::RunEnd> end = RunToEnd(
      options.command, *folder, stop,
      [&](const v1::Progress& progress) { daemon.ReportProgress(run, progress).IgnoreError(); });
  if (!end.ok()) return end.status();
  const bool done = end->exit_status() == 0 && !end->has_error();
  return Patiently(
      stop, [&] { return daemon.UploadResult(run, *end, done ? folder->File("model") : ""); });
}

}  // namespace carillon::cli
