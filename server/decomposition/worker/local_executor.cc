// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/local_executor.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <semaphore>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/mutex.h"
#include "server/base/usable_memory.h"
#include "server/decomposition/worker/local_worker.h"
#include "server/decomposition/worker/work_folder.h"

namespace carillon {
namespace {

using std::chrono::nanoseconds;

// Time between two checks of memory and clocks while a worker runs. A worker touches new memory at
// 1 to 2 GB/s, so it cannot get far beyond its limit in between.
constexpr int kTickMs = 100;

/// A thread that runs functions which wait for the disk, one after the other.
class FileThread {
 public:
  FileThread() : thread_([this] { Work(); }) {}
  FileThread(const FileThread&) = delete;
  FileThread& operator=(const FileThread&) = delete;
  ~FileThread() { End(); }

  void Run(std::function<void()> work) {
    {
      MutexLock lock(&mutex_);
      waiting_.push_back(std::move(work));
    }
    ready_.release();
  }

  /// Drops the functions that wait and returns when none runs. May be called again.
  void End() {
    {
      MutexLock lock(&mutex_);
      ended_ = true;
      waiting_.clear();
    }
    ready_.release();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void Work() {
    while (const std::function<void()> work = Take()) work();
  }

  std::function<void()> Take() {
    ready_.acquire();
    MutexLock lock(&mutex_);
    if (ended_) return nullptr;
    std::function<void()> work = std::move(waiting_.front());
    waiting_.pop_front();
    return work;
  }

  Mutex mutex_;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<std::function<void()>> waiting_ ABSL_GUARDED_BY(mutex_);
  std::counting_semaphore<> ready_{0};
  std::thread thread_;
};

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
    files_.End();
    close(wake_);
  }

  int worker_count() const override { return options_.worker_count; }
  bool transfers_yield() const override { return true; }
  uint64_t memory_budget_bytes() const override { return options_.memory_budget_bytes; }

  void Start(DecompositionTask task) override {
    {
      MutexLock lock(&mutex_);
      preparing_.insert(task.digest);
    }
    files_.Run([this, task = std::move(task)] { Prepare(task); });
  }

  void Cancel(const std::string& digest) override {
    MutexLock lock(&mutex_);
    cancels_.push_back(digest);
    Wake();
  }

 private:
  void Wake() const {
    const uint64_t one = 1;
    // The write fails only if the counter is full, and then the thread is awake anyway.
    [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
  }

  // Runs on the thread for files. Each run has a folder of its own, because the folder of the run
  // before may still exist.
  void Prepare(const DecompositionTask& task) {
    // Somebody may have removed the folder of all runs. Any other fault is found below.
    mkdir(options_.directory.c_str(), 0700);
    const std::filesystem::path folder =
        options_.directory / absl::StrCat(task.digest, "-", ++folder_count_);
    absl::StatusOr<PreparedTask> prepared = PreparedTask::Make(task, folder);
    const absl::Status status = prepared.status();
    {
      MutexLock lock(&mutex_);
      preparing_.erase(task.digest);
      if (status.ok()) starts_.push_back(*std::move(prepared));
    }
    if (!status.ok()) task.on_end({Verdict::kCrashed, ToErrorInfo(status), {}});
    Wake();
  }

  void Run() {
    while (TakeCommands()) {
      Wait();
      // All events are read before any limit is enforced: if this thread was delayed, the events
      // that came in between still count as signs of life.
      for (LocalWorker& worker : workers_) worker.Read(clock_.Monotonic());
      Enforce();
      CollectEnded();
    }
    workers_.clear();
  }

  // Returns false when the executor stops.
  bool TakeCommands() {
    std::vector<PreparedTask> starts;
    std::vector<std::string> cancels;
    {
      MutexLock lock(&mutex_);
      if (stopping_) return false;
      starts.swap(starts_);
      cancels.swap(cancels_);
      // A task that is still being prepared is cancelled as soon as it is ready.
      for (const std::string& digest : cancels) {
        if (preparing_.contains(digest)) cancels_.push_back(digest);
      }
    }
    for (PreparedTask& start : starts) StartWorker(std::move(start));
    for (LocalWorker& worker : workers_) {
      if (std::ranges::find(cancels, worker.task().digest) != cancels.end()) worker.Cancel();
    }
    return true;
  }

  void StartWorker(PreparedTask prepared) {
    const auto on_end = prepared.task.on_end;
    absl::StatusOr<LocalWorker> worker =
        LocalWorker::Start(std::move(prepared), system_, share_, limits_, clock_.Monotonic());
    if (worker.ok()) {
      workers_.push_back(*std::move(worker));
    } else {
      const Outcome outcome{Verdict::kCrashed, ToErrorInfo(worker.status()), {}};
      files_.Run([on_end, outcome] { on_end(outcome); });
    }
  }

  void Wait() const {
    std::vector<pollfd> polled = {{wake_, POLLIN, 0}};
    for (const LocalWorker& worker : workers_) {
      for (const int descriptor : worker.descriptors()) {
        polled.push_back({descriptor, POLLIN, 0});  // poll ignores -1
      }
    }
    poll(polled.data(), polled.size(), workers_.empty() ? -1 : kTickMs);
    uint64_t count = 0;
    if ((polled.front().revents & POLLIN) != 0) {
      [[maybe_unused]] const ssize_t got = read(wake_, &count, sizeof count);
    }
  }

  // If all workers together exceed the budget, the youngest is ended, because it loses least work;
  // if transfers run, the youngest transfer, because decompositions do not wait for transfers.
  void Enforce() {
    uint64_t total_bytes = 0;
    for (LocalWorker& worker : workers_) total_bytes += worker.Enforce(clock_.Monotonic());
    if (workers_.size() > 1 && total_bytes > options_.memory_budget_bytes) {
      const auto transfer =
          std::find_if(workers_.rbegin(), workers_.rend(),
                       [](const LocalWorker& worker) { return worker.task().radiates; });
      LocalWorker& ended = transfer == workers_.rend() ? workers_.back() : *transfer;
      ended.MakeRoom(options_.memory_budget_bytes);
    }
  }

  void CollectEnded() {
    for (auto worker = workers_.begin(); worker != workers_.end();) {
      const std::optional<Outcome> outcome = worker->TakeOutcome(clock_.Monotonic());
      if (!outcome.has_value()) {
        ++worker;
        continue;
      }
      const auto ended = std::make_shared<LocalWorker>(std::move(*worker));
      worker = workers_.erase(worker);
      // The caller stores the end on the disk, which must not delay the events of other workers.
      files_.Run([ended, outcome = *outcome] { ended->task().on_end(outcome); });
    }
  }

  const LocalExecutorOptions options_;
  const WorkerSystem system_{options_.program, options_.kernel_counts};
  const WorkerLimits limits_{options_.memory_limit_bytes, options_.time_limit,
                             options_.stall_limit};
  const WorkerShare share_{options_.threads_per_worker,
                           options_.threads_per_worker* options_.worker_count};
  const Clock& clock_;
  const int wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::list<LocalWorker> workers_;  // of the thread, oldest first
  uint64_t folder_count_ = 0;       // of the thread for files
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<std::string> preparing_ ABSL_GUARDED_BY(mutex_);
  std::vector<PreparedTask> starts_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> cancels_ ABSL_GUARDED_BY(mutex_);
  FileThread files_;
  std::thread thread_;
};

}  // namespace

absl::Status CheckLocalExecutor(const LocalExecutorOptions& options) {
  if (access(options.program.c_str(), X_OK) == 0) return absl::OkStatus();
  return Refusal(absl::StatusCode::kFailedPrecondition, "WORKER_NOT_FOUND",
                 absl::StrCat(options.program.string(),
                              " cannot be executed: install carillon-precompute, or name it"));
}

absl::StatusOr<std::unique_ptr<Executor>> MakeLocalExecutor(const LocalExecutorOptions& options,
                                                            const Clock& clock) {
  RETURN_IF_ERROR(CheckLocalExecutor(options));
  RETURN_IF_ERROR(PrepareWorkFolder(options.directory));
  LocalExecutorOptions filled = options;
  filled.program = std::filesystem::absolute(options.program);
  if (filled.worker_count == 0) {
    filled.worker_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / 2);
  }
  if (filled.memory_budget_bytes == 0) filled.memory_budget_bytes = UsableMemoryBytes() / 2;
  if (filled.memory_limit_bytes == 0) filled.memory_limit_bytes = filled.memory_budget_bytes;
  return std::make_unique<LocalExecutor>(std::move(filled), clock);
}

}  // namespace carillon
