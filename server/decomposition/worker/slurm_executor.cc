// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/slurm_executor.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <list>
#include <set>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "server/base/mutex.h"
#include "server/decomposition/worker/slurm_queue.h"
#include "server/decomposition/worker/slurm_task.h"

namespace carillon {
namespace {

// A job that has left the queue is taken for lost after more checks than this: its result may still
// be on its way through the shared folder.
constexpr int kLooksBeforeLost = 2;

class SlurmExecutor final : public Executor {
 public:
  explicit SlurmExecutor(SlurmExecutorOptions options)
      : options_(std::move(options)), thread_([this] { Run(); }) {}

  ~SlurmExecutor() override {
    {
      MutexLock lock(&mutex_);
      stopping_ = true;
    }
    Wake();
    thread_.join();
    close(wake_);
  }

  int worker_count() const override { return options_.job_count; }

  // Slurm decides which of its jobs run.
  bool transfers_yield() const override { return false; }

  // Slurm reserves the memory.
  uint64_t memory_budget_bytes() const override { return std::numeric_limits<uint64_t>::max() / 2; }

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
  struct Tracked {
    SlurmTask task;
    int looks_in_vain = 0;
  };

  void Wake() const {
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
  }

  void Run() {
    while (TakeCommands()) {
      CollectEnded();
      if (!tasks_.empty() || !ended_.empty()) Reconcile();
      Wait();
    }
  }

  void Wait() const {
    pollfd polled{wake_, POLLIN, 0};
    poll(&polled, 1,
         tasks_.empty() && ended_.empty() ? -1 : static_cast<int>(options_.poll_interval.count()));
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = read(wake_, &count, sizeof count);
  }

  bool TakeCommands() {
    std::vector<DecompositionTask> starts;
    std::vector<std::string> cancels;
    {
      MutexLock lock(&mutex_);
      if (stopping_) return false;
      starts.swap(starts_);
      cancels.swap(cancels_);
    }
    for (DecompositionTask& task : starts) Prepare(std::move(task));
    for (const std::string& digest : cancels) {
      const auto found = std::ranges::find_if(
          tasks_, [&](const Tracked& t) { return t.task.task().digest == digest; });
      if (found == tasks_.end()) continue;
      End(found, {Verdict::kCancelled, {}, {}});
    }
    return true;
  }

  void Prepare(DecompositionTask task) {
    const auto on_end = task.on_end;
    absl::StatusOr<SlurmTask> prepared = SlurmTask::Prepare(std::move(task), options_);
    if (prepared.ok()) {
      tasks_.push_back({*std::move(prepared), 0});
    } else {
      on_end({Verdict::kCrashed, ToErrorInfo(prepared.status()), {}});
    }
  }

  void CollectEnded() {
    for (auto tracked = tasks_.begin(); tracked != tasks_.end();) {
      const auto here = tracked++;
      if (IsStopping()) return;
      if (const auto outcome = here->task.TakeEnd()) {
        End(here, *outcome);
      } else {
        here->task.ReadProgress();
      }
    }
  }

  // The folder is removed after the model is stored. If the daemon dies before, the next one finds
  // the end in the folder again.
  void End(std::list<Tracked>::iterator tracked, const Outcome& outcome) {
    const SlurmTask task = std::move(tracked->task);
    tasks_.erase(tracked);
    task.task().on_end(outcome);
    task.Remove();
    ended_.insert(task.job().name);
  }

  // Cancels second runs of ended jobs, and ended jobs that the controller believes to run.
  void CancelWhatIsLeft(const SlurmJobs& jobs) {
    for (const Tracked& tracked : tasks_) ended_.erase(tracked.task.job().name);
    for (const auto& [key, state] : jobs) {
      if (state == SlurmState::kWaitsOrRuns && ended_.contains(key.first)) CancelByName(key.first);
    }
    ended_.clear();
  }

  // Submits the jobs that have neither ended nor are in the queue.
  void Reconcile() {
    const std::optional<SlurmJobs> jobs = ReadSqueue();
    if (!jobs.has_value()) return;  // the controller is down and no state is known
    CancelWhatIsLeft(*jobs);
    for (auto tracked = tasks_.begin(); tracked != tasks_.end();) {
      const auto here = tracked++;
      if (IsStopping()) return;
      const SlurmJob& job = here->task.job();
      const auto known = jobs->find({job.name, job.ticket});
      if (known == jobs->end()) {
        SubmitUnlessEnded(here);
      } else if (known->second == SlurmState::kWaitsOrRuns) {
        here->looks_in_vain = 0;
      } else if (++here->looks_in_vain > kLooksBeforeLost) {
        JudgeLoss(here, known->second);
      }
    }
  }

  // The job is not in the queue: it was never submitted, the controller forgot it, or it ended
  // just now.
  void SubmitUnlessEnded(std::list<Tracked>::iterator tracked) {
    if (tracked->task.TakeEnd().has_value()) return;  // CollectEnded takes it next time
    JudgeLoss(tracked, ReadSacct(tracked->task.job().name, tracked->task.job().ticket));
  }

  void JudgeLoss(std::list<Tracked>::iterator tracked, std::optional<SlurmState> state) {
    if (tracked->task.TakeEnd().has_value()) return;
    const std::optional<Outcome> outcome = tracked->task.JudgeLoss(state);
    if (outcome.has_value()) {
      End(tracked, *outcome);
    } else {
      tracked->looks_in_vain = 0;
      if (state == SlurmState::kStuck) CancelByName(tracked->task.job().name);
      // If the submission cannot be prepared, perhaps because the disk is full, the next check
      // tries again.
      if (const auto job = tracked->task.NextSubmission(); job.ok()) Submit(*job);
    }
  }

  bool IsStopping() {
    MutexLock lock(&mutex_);
    return stopping_;
  }

  const SlurmExecutorOptions options_;
  const int wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  std::list<Tracked> tasks_;     // of the thread
  std::set<std::string> ended_;  // of the thread: names of jobs since the last look at the queue
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<DecompositionTask> starts_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> cancels_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Executor>> MakeSlurmExecutor(const SlurmExecutorOptions& options) {
  std::error_code error;
  SlurmExecutorOptions filled = options;
  filled.directory = std::filesystem::absolute(options.directory);
  filled.program = std::filesystem::absolute(options.program);
  std::filesystem::create_directories(filled.directory, error);
  if (error) {
    return Refusal(absl::StatusCode::kFailedPrecondition, "DATABASE_UNUSABLE",
                   absl::StrCat("the folder ", filled.directory.string(), " cannot be made (",
                                error.message(), "): name one that every node shares"));
  }
  return std::make_unique<SlurmExecutor>(std::move(filled));
}

}  // namespace carillon
