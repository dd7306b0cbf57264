// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/local_executor.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <list>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/base/mutex.h"
#include "server/decomposition/local_worker.h"

namespace carillon {
namespace {

using std::chrono::nanoseconds;

// Between looks at memory and clocks while anything runs: a worker touches new memory at 1 to 2
// GB/s, so it cannot get far beyond its limit.
constexpr int kTickMs = 100;

class LocalExecutor final : public Executor {
 public:
  LocalExecutor(LocalExecutorOptions options, const Clock& clock)
      : options_(std::move(options)), clock_(clock), thread_([this] { Run(); }) {}

  ~LocalExecutor() override {
    {
      MutexLock lock(&mutex_);
      stopping_ = true;
    }
    Wake();
    thread_.join();
    close(wake_);
  }

  int worker_count() const override { return options_.worker_count; }

  void Start(DecompositionTask task) override {
    MutexLock lock(&mutex_);
    starts_.push_back(std::move(task));
    Wake();
  }

  void Cancel(const std::string& digest) override {
    MutexLock lock(&mutex_);
    cancels_.push_back(digest);
    Wake();
  }

 private:
  void Wake() const {
    const uint64_t one = 1;
    // Fails only when the counter is full, and then the thread is awake anyway.
    [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
  }

  void Run() {
    while (TakeCommands()) {
      Wait();
      // All reading before any judging: where this thread was held up, what the workers wrote
      // meanwhile counts.
      for (LocalWorker& worker : workers_) worker.Read(clock_.Monotonic());
      for (LocalWorker& worker : workers_) worker.Enforce(limits_, clock_.Monotonic());
      CollectEnded();
    }
    workers_.clear();
  }

  // False when it is time to stop.
  bool TakeCommands() {
    std::vector<DecompositionTask> starts;
    std::vector<std::string> cancels;
    {
      MutexLock lock(&mutex_);
      if (stopping_) return false;
      starts.swap(starts_);
      cancels.swap(cancels_);
    }
    for (DecompositionTask& task : starts) StartWorker(std::move(task));
    for (LocalWorker& worker : workers_) {
      if (std::ranges::find(cancels, worker.task().digest) != cancels.end()) worker.Cancel();
    }
    return true;
  }

  void StartWorker(DecompositionTask task) {
    const auto on_end = task.on_end;
    const std::filesystem::path folder = options_.directory / task.digest;
    absl::StatusOr<LocalWorker> worker = LocalWorker::Start(
        std::move(task), folder, options_.program, options_.threads_per_worker, clock_.Monotonic());
    if (worker.ok()) {
      workers_.push_back(*std::move(worker));
    } else {
      on_end({Verdict::kCrashed, ToErrorInfo(worker.status()), {}});
    }
  }

  void Wait() const {
    std::vector<pollfd> polled = {{wake_, POLLIN, 0}};
    for (const LocalWorker& worker : workers_) {
      const ChildProcess& process = worker.process();
      for (const int descriptor :
           {process.process_descriptor(), process.event_descriptor(), process.error_descriptor()}) {
        polled.push_back({descriptor, POLLIN, 0});  // poll ignores -1
      }
    }
    poll(polled.data(), polled.size(), workers_.empty() ? -1 : kTickMs);
    uint64_t count = 0;
    if ((polled.front().revents & POLLIN) != 0) {
      [[maybe_unused]] const ssize_t got = read(wake_, &count, sizeof count);
    }
  }

  void CollectEnded() {
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      const std::optional<Outcome> outcome = worker->TakeOutcome(clock_.Monotonic());
      if (outcome.has_value()) {
        worker->task().on_end(*outcome);
        worker = workers_.erase(worker);
      } else {
        ++worker;
      }
    }
  }

  const LocalExecutorOptions options_;
  const WorkerLimits limits_{options_.memory_limit_bytes, options_.time_limit,
                             options_.stall_limit};
  const Clock& clock_;
  const int wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::list<LocalWorker> workers_;  // of the thread
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<DecompositionTask> starts_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> cancels_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

// Empties the directory, which only this user may enter.
absl::Status PrepareDirectory(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::remove_all(directory, error);
  if (!error) std::filesystem::create_directories(directory, error);
  if (!error) {
    std::filesystem::permissions(directory, std::filesystem::perms::owner_all, error);
  }
  if (!error) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                 absl::StrCat("the folder ", directory.string(), " cannot be made (",
                              error.message(), "): name one that this user may write"));
}

uint64_t PhysicalBytes() {
  return static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) *
         static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Executor>> MakeLocalExecutor(const LocalExecutorOptions& options,
                                                            const Clock& clock) {
  if (access(options.program.c_str(), X_OK) != 0) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "WORKER_NOT_FOUND",
                   absl::StrCat(options.program.string(),
                                " cannot be executed: install carillon-precompute, or name it"));
  }
  if (const absl::Status status = PrepareDirectory(options.directory); !status.ok()) return status;
  LocalExecutorOptions filled = options;
  filled.program = std::filesystem::absolute(options.program);
  if (filled.worker_count == 0) {
    filled.worker_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / 2);
  }
  if (filled.memory_limit_bytes == 0) {
    filled.memory_limit_bytes = PhysicalBytes() / 2 / static_cast<uint64_t>(filled.worker_count);
  }
  return std::make_unique<LocalExecutor>(std::move(filled), clock);
}

}  // namespace carillon
