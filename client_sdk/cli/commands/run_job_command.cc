// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "carillon/worker/v1/worker.pb.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/job_runs/job_run_client.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using std::chrono::steady_clock;

constexpr int kSignalled = 128;  // what a shell adds to the number of a signal
constexpr int kNotFound = 127;   // as a shell has it
constexpr auto kPatience = std::chrono::minutes(10);
constexpr auto kBetweenReports = std::chrono::seconds(1);
constexpr double kFirstPause_s = 0.5;
constexpr double kLongestPause_s = 10;

absl::Status Stopped() {
  return Refusal(
      absl::StatusCode::kCancelled, "RUN_STOPPED",
      "a signal stopped the run, which uploads no result; start it again if the result is needed");
}

/// A temporary folder of this run; the destructor deletes it.
class RunFolder {
 public:
  static absl::StatusOr<RunFolder> Make() {
    const char* const temporary = std::getenv("TMPDIR");
    std::string path =
        absl::StrCat(temporary == nullptr ? "/tmp" : temporary, "/carillon-run-XXXXXX");
    if (mkdtemp(path.data()) != nullptr) return RunFolder(path);
    return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat(path, " cannot be made; set $TMPDIR to a folder with free space"));
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

/// Copies the standard input, which is the request for the command, to a file.
absl::Status SaveStandardInput(const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  if (isatty(STDIN_FILENO) == 0 && std::cin.peek() != std::char_traits<char>::eof()) {
    file << std::cin.rdbuf();
  }
  file.close();
  if (!file.fail()) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path, " cannot be written: name a folder with room in $TMPDIR"));
}

/// Repeats the call while no daemon answers, because the daemon may be restarting.
absl::Status Patiently(const StopSignal& stop, const std::function<absl::Status()>& call) {
  const auto deadline = steady_clock::now() + kPatience;
  for (double pause_s = kFirstPause_s;; pause_s = std::min(2 * pause_s, kLongestPause_s)) {
    absl::Status status = call();
    const bool silent = absl::IsUnavailable(status) || absl::IsDeadlineExceeded(status);
    if (!silent || steady_clock::now() > deadline) return status;
    if (stop.ArrivesWithin(pause_s)) return Stopped();
  }
}

/// Reads the events of the command until it closes the pipe: keeps its error, if any, and passes
/// progress on. A command that goes on writing after something that is no event gets SIGPIPE.
void FollowEvents(Pipe events, worker::v1::RunEnd& end,
                  const std::function<void(const v1::Progress&)>& on_progress) {
  events.CloseWriteEnd();
  google::protobuf::io::FileInputStream in(events.read_end());
  auto reported = steady_clock::now() - kBetweenReports;
  worker::v1::WorkerEvent event;
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
      Refusal(absl::StatusCode::kDataLoss, "WORKER_CRASHED",
              "the decomposing process wrote to its event pipe what is no event: this is a fault "
              "in it; report it with the mesh"));
}

std::string HostName() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "the node";
}

/// The end of a run whose command could not be started.
worker::v1::RunEnd NotStarted(const std::string& program) {
  worker::v1::RunEnd end;
  end.set_exit_status(kNotFound);
  *end.mutable_error() =
      ToErrorInfo(Refusal(absl::StatusCode::kFailedPrecondition, "WORKER_NOT_FOUND",
                          absl::StrCat(program, " cannot be started on ", HostName(),
                                       ": install it there, or name another with --precompute")));
  return end;
}

absl::StatusOr<worker::v1::RunEnd> RunToEnd(
    const std::vector<std::string>& command, const RunFolder& folder, const StopSignal& stop,
    const std::function<void(const v1::Progress&)>& on_progress) {
  absl::StatusOr<Pipe> events = Pipe::Make();
  if (!events.ok()) return NotStarted(command.front());
  absl::StatusOr<ChildProcess> child = ChildProcess::Start({.words = command,
                                                            .input = STDIN_FILENO,
                                                            .errors = STDERR_FILENO,
                                                            .events = events->write_end(),
                                                            .folder = folder.path().string()});
  if (!child.ok()) return NotStarted(command.front());
  std::atomic<bool> stopped = false;
  std::jthread watch([&](const std::stop_token& over) {
    while (!over.stop_requested()) {
      if (!stop.ArrivesWithin(0.1)) continue;
      stopped = true;
      child->Kill(SIGTERM);
      return;
    }
  });
  worker::v1::RunEnd end;
  FollowEvents(*std::move(events), end, on_progress);
  watch.request_stop();
  watch.join();
  const ProcessEnd ended = child->Wait();
  end.set_exit_status(ended.exited ? ended.status : kSignalled + ended.status);
  // A run that was told to stop must not look like a crash.
  if (stopped || stop.ArrivesWithin(0)) return Stopped();
  return end;
}

}  // namespace

absl::Status RunJob(const client::JobRunClient& run, const std::vector<std::string>& command,
                    const StopSignal& stop) {
  unsetenv("CARILLON_JOB_TOKEN");  // of no use to the command
  ASSIGN_OR_RETURN(const RunFolder folder, RunFolder::Make());
  RETURN_IF_ERROR(SaveStandardInput(folder.File("request")));
  RETURN_IF_ERROR(Patiently(stop, [&] { return run.FetchMesh(folder.File("mesh")); }));
  const absl::StatusOr<worker::v1::RunEnd> end =
      RunToEnd(command, folder, stop,
               [&](const v1::Progress& progress) { run.ReportProgress(progress).IgnoreError(); });
  if (!end.ok()) return end.status();
  const bool done = end->exit_status() == 0 && !end->has_error();
  return Patiently(stop, [&] { return run.UploadResult(*end, done ? folder.File("model") : ""); });
}

}  // namespace carillon::cli
