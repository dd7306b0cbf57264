// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/local_executor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <atomic>
#include <chrono>
#include <future>
#include <limits>

#include "server/base/sha256.h"
#include "server/decomposition/job/decomposition_request.h"
#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

constexpr std::chrono::seconds kDeadline(30);

/// One task, and what became of it.
struct TaskRun {
  std::promise<void> progressed;
  std::promise<void> ended;
  std::vector<double> fractions;
  Outcome outcome;
  std::string model;  // content of the model file
};

/// Whether it does so in time. Call once.
bool Happens(std::promise<void>& event) {
  return event.get_future().wait_for(kDeadline) == std::future_status::ready;
}

class LocalExecutorTest : public ::testing::Test {
 protected:
  void MakeExecutor(const std::string& script) {
    options_.program = WriteWorkerScript(folder_.path(), script);
    options_.directory = folder_ / "running";
    auto executor = MakeLocalExecutor(options_, clock_);
    ASSERT_TRUE(executor.ok()) << executor.status();
    executor_ = *std::move(executor);
  }

  /// Makes an executor for two workers, each of which takes over half of the memory.
  void MakeCrowdedExecutor() {
    options_.worker_count = 2;
    options_.memory_budget_bytes = 40 << 20;
    options_.memory_limit_bytes = 1 << 30;
    WriteEvents(ProgressBytes(0.5));
    // 34 MB of text each, and what the shell takes for it.
    MakeExecutor(
        "x=0123456789abcdef; for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21; do "
        "x=$x$x; "
        "done; cat \"$here/events\" >&3; sleep 1000");
  }

  void Start(TaskRun& run) { Start(run, digest_); }

  void Start(TaskRun& run, const std::string& digest) {
    executor_->Start({.digest = digest,
                      .radiates = radiates_,
                      .request = request_,
                      .way = 0,
                      .write_input =
                          [](const std::filesystem::path& file) {
                            WriteBytes(file, "solid");
                            return absl::OkStatus();
                          },
                      .on_progress =
                          [&run](const v1::Progress& progress) {
                            run.fractions.push_back(progress.fraction());
                            if (run.fractions.size() == 1) run.progressed.set_value();
                          },
                      .on_end =
                          [&run](const Outcome& outcome) {
                            run.outcome = outcome;
                            if (outcome.verdict == Verdict::kOk)
                              run.model = ReadBytes(outcome.model_file);
                            run.ended.set_value();
                          }});
  }

  Outcome RunScript(const std::string& script) {
    MakeExecutor(script);
    Start(run_);
    EXPECT_TRUE(Happens(run_.ended));
    return run_.outcome;
  }

  void WriteEvents(const std::string& bytes) { WriteBytes(folder_ / "events", bytes); }

  TemporaryFolder folder_;
  SystemClock clock_;
  bool radiates_ = false;  // whether the tasks that start are transfers
  LocalExecutorOptions options_;
  const std::string digest_ = Sha256Hex("task");
  v1::CreateModalModelRequest request_ = *ResolveRequest(SampleRequest(Sha256Hex("solid")));
  TaskRun run_;
  std::unique_ptr<Executor> executor_;
};

TEST_F(LocalExecutorTest, HandsOverWhatTheWorkerMadeOfTheMesh) {
  const Outcome outcome = RunScript("tr a-z A-Z <\"$mesh\" >\"$out\"");
  EXPECT_EQ(outcome.verdict, Verdict::kOk) << outcome.error.message();
  EXPECT_EQ(run_.model, "SOLID");
}

TEST_F(LocalExecutorTest, RunsTheWorkerNicedAndNoisyStreamsHarmless) {
  const Outcome outcome =
      RunScript("nice >\"$out\"; cat; head -c 1000000 /dev/zero; head -c 1000000 /dev/zero >&2");
  EXPECT_EQ(outcome.verdict, Verdict::kOk) << outcome.error.message();
  EXPECT_EQ(run_.model, "5\n");
}

TEST_F(LocalExecutorTest, PassesProgressOnAndNeverLetsItGoBack) {
  WriteEvents(ProgressBytes(0.5) + ProgressBytes(0.25) + ProgressBytes(-1) +
              ProgressBytes(std::numeric_limits<double>::quiet_NaN()) + ProgressBytes(7));
  EXPECT_EQ(RunScript("cat \"$here/events\" >&3").verdict, Verdict::kOk);
  EXPECT_THAT(run_.fractions, ::testing::ElementsAre(0.5, 0.5, 0.5, 0.5, 1));
}

TEST_F(LocalExecutorTest, TellsARefusalFromOtherEnds) {
  WriteEvents(ErrorBytes("MESH_NOT_CLOSED"));
  const Outcome outcome = RunScript("cat \"$here/events\" >&3; exit 2");
  EXPECT_EQ(outcome.verdict, Verdict::kBadInput);
  EXPECT_EQ(outcome.error.reason(), "MESH_NOT_CLOSED");
}

TEST_F(LocalExecutorTest, ACrashIsReportedWithTheLastWords) {
  const Outcome outcome = RunScript("echo 'segment 7 is \xff bad' >&2; kill -SEGV $$");
  EXPECT_EQ(outcome.verdict, Verdict::kCrashed);
  EXPECT_EQ(outcome.error.reason(), "WORKER_CRASHED");
  EXPECT_THAT(outcome.error.message(), HasSubstr("signal 11"));
  EXPECT_THAT(outcome.error.message(), HasSubstr("segment 7 is   bad"));
}

/// Checks the outcome of a worker that somebody else has ended.
void ExpectKilled(const Outcome& outcome, Verdict verdict, const std::string& message) {
  EXPECT_TRUE(outcome.killed);
  EXPECT_EQ(outcome.verdict, verdict);
  EXPECT_THAT(outcome.error.message(), HasSubstr(message));
}

TEST_F(LocalExecutorTest, AKillIsTheKernelsForLackOfMemoryIfTheKernelSaysSo) {
  options_.kernel_counts = folder_ / "vmstat";
  WriteBytes(options_.kernel_counts, "pgfault 7\noom_kill 3\nballoon_inflate 0\n");
  const Outcome outcome = RunScript("echo 'oom_kill 4' >\"$here/vmstat\"; kill -KILL $$");
  ExpectKilled(outcome, Verdict::kOutOfMemory, "by the system for lack of memory");
  EXPECT_EQ(outcome.error.reason(), "OUT_OF_MEMORY");
}

TEST_F(LocalExecutorTest, AKillWithoutALackOfMemoryIsSomebodyElses) {
  options_.kernel_counts = folder_ / "vmstat";
  WriteBytes(options_.kernel_counts, "oom_kill 3\n");
  const Outcome outcome = RunScript("kill -KILL $$");
  ExpectKilled(outcome, Verdict::kCrashed,
               "signal 9 from outside, and not by the kernel for lack of memory: see who");
  EXPECT_EQ(outcome.error.reason(), "WORKER_CRASHED");
}

TEST_F(LocalExecutorTest, KillsAWorkerThatTakesTooMuchMemory) {
  options_.memory_limit_bytes = 100 << 20;
  // Doubled until it is killed.
  const Outcome outcome = RunScript("x=0123456789abcdef; while :; do x=$x$x; done");
  EXPECT_EQ(outcome.verdict, Verdict::kOutOfMemory);
  EXPECT_THAT(outcome.error.message(), HasSubstr("100 MiB"));
}

TEST_F(LocalExecutorTest, TheRequestsOwnLimitsBindWhereTheyAreLower) {
  request_.set_memory_limit_bytes(50 << 20);
  const Outcome outcome = RunScript("x=0123456789abcdef; while :; do x=$x$x; done");
  EXPECT_EQ(outcome.verdict, Verdict::kOutOfMemory);
  EXPECT_THAT(outcome.error.message(), HasSubstr("50 MiB"));
  EXPECT_GT(outcome.peak_bytes, 50U << 20);
  EXPECT_FALSE(outcome.crowded);
}

TEST_F(LocalExecutorTest, ALackOfMemoryTellsHowMuchTheMeshWouldNeed) {
  worker::v1::WorkerEvent event;
  event.mutable_progress()->set_node_count(1'000'000);
  WriteEvents(EventBytes(event));
  options_.kernel_counts = folder_ / "vmstat";
  WriteBytes(options_.kernel_counts, "oom_kill 0\n");
  EXPECT_THAT(
      RunScript("cat \"$here/events\" >&3; echo 'oom_kill 1' >\"$here/vmstat\"; kill -KILL $$")
          .error.message(),
      HasSubstr("with its 1000000 nodes it would need about 62"));
}

TEST_F(LocalExecutorTest, WhereAllTogetherTakeTooMuchTheYoungestMakesRoom) {
  MakeCrowdedExecutor();
  Start(run_);
  ASSERT_TRUE(Happens(run_.progressed));
  TaskRun second;
  Start(second, Sha256Hex("second"));
  ASSERT_TRUE(Happens(second.ended));
  EXPECT_EQ(second.outcome.verdict, Verdict::kOutOfMemory);
  EXPECT_TRUE(second.outcome.crowded);
  executor_->Cancel(digest_);
  ASSERT_TRUE(Happens(run_.ended));
  EXPECT_EQ(run_.outcome.verdict, Verdict::kCancelled);
}

TEST_F(LocalExecutorTest, WhereAllTogetherTakeTooMuchATransferMakesRoomForAYoungerDecomposition) {
  MakeCrowdedExecutor();
  radiates_ = true;
  Start(run_);
  ASSERT_TRUE(Happens(run_.progressed));
  radiates_ = false;
  TaskRun model;
  Start(model, Sha256Hex("model"));
  ASSERT_TRUE(Happens(run_.ended));
  EXPECT_TRUE(run_.outcome.crowded);
  ASSERT_TRUE(Happens(model.progressed));
  executor_->Cancel(Sha256Hex("model"));
  ASSERT_TRUE(Happens(model.ended));
  EXPECT_EQ(model.outcome.verdict, Verdict::kCancelled);
}

TEST_F(LocalExecutorTest, WorkersKeepToTheirShareOfTheProcessors) {
  options_.worker_count = 1;
  RunScript("nproc >\"$out\"");
  EXPECT_EQ(run_.model, "1\n");
}

TEST_F(LocalExecutorTest, KillsAWorkerWithoutSignsOfLifeAndItsChildren) {
  const NamedPipe life(folder_ / "life");
  options_.stall_limit = milliseconds(1000);
  const Outcome outcome = RunScript("exec 4>\"$here/life\"; sleep 1000 & wait");
  EXPECT_EQ(outcome.verdict, Verdict::kStalled);
  EXPECT_EQ(outcome.error.reason(), "WORKER_STALLED");
  EXPECT_TRUE(life.LosesItsWriters());
}

/// A clock that only a test moves, and that tells when it has been read.
class MovedClock final : public Clock {
 public:
  std::chrono::nanoseconds Monotonic() const noexcept override {
    ++read_count_;
    read_count_.notify_all();
    return std::chrono::nanoseconds(now_ns_);
  }
  int64_t UnixMs() const noexcept override { return 0; }

  void Move(std::chrono::nanoseconds time) { now_ns_ += time.count(); }

  /// Waits until others have read the clock this often.
  void AwaitReads(int count) const {
    const int last = read_count_ + count;
    for (int seen = read_count_; seen < last; seen = read_count_) read_count_.wait(seen);
  }

 private:
  std::atomic<int64_t> now_ns_{0};
  mutable std::atomic<int> read_count_{0};
};

TEST_F(LocalExecutorTest, AWorkerThatWaitsForAProcessorIsNotStalled) {
  WriteEvents(ProgressBytes(0.5));
  MovedClock clock;
  options_.program = WriteWorkerScript(
      folder_.path(),
      "cat \"$here/events\" >&3; until [ -e \"$here/go\" ]; do :; done; echo sound >\"$out\"");
  options_.directory = folder_ / "running";
  options_.stall_limit = std::chrono::minutes(10);
  executor_ = *MakeLocalExecutor(options_, clock);
  Start(run_);
  ASSERT_TRUE(Happens(run_.progressed));
  // The worker computes throughout, but an hour passes in which it gets no more than a second.
  for (int hour_part = 0; hour_part < 4; ++hour_part) {
    clock.Move(std::chrono::minutes(15));
    clock.AwaitReads(4);
  }
  WriteBytes(folder_ / "go", "");
  ASSERT_TRUE(Happens(run_.ended));
  EXPECT_EQ(run_.outcome.verdict, Verdict::kOk) << run_.outcome.error.message();
  EXPECT_EQ(run_.model, "sound\n");
  executor_.reset();  // before its clock
}

TEST_F(LocalExecutorTest, AWorkerThatComputesWithoutAnEventIsStalled) {
  options_.stall_limit = milliseconds(300);
  EXPECT_EQ(RunScript("while :; do :; done").verdict, Verdict::kStalled);
}

TEST_F(LocalExecutorTest, KillsAWorkerThatLivesButNeverEnds) {
  WriteEvents(ProgressBytes(0.5));
  options_.time_limit = milliseconds(300);
  EXPECT_EQ(RunScript("while :; do cat \"$here/events\" >&3; sleep 0.05; done").verdict,
            Verdict::kTimeout);
}

TEST_F(LocalExecutorTest, CancelsARunningWorker) {
  WriteEvents(ProgressBytes(0.5));
  MakeExecutor("cat \"$here/events\" >&3; sleep 1000");
  Start(run_);
  ASSERT_TRUE(Happens(run_.progressed));
  executor_->Cancel(digest_);
  ASSERT_TRUE(Happens(run_.ended));
  EXPECT_EQ(run_.outcome.verdict, Verdict::kCancelled);
}

TEST_F(LocalExecutorTest, AMeshThatCannotBeBroughtEndsTheTask) {
  MakeExecutor("true");
  std::promise<Outcome> ended;
  executor_->Start(
      {.digest = digest_,
       .request = {},
       .way = 0,
       .write_input = [](const auto&) { return absl::DataLossError("DATABASE_CORRUPT: x"); },
       .on_progress = [](const v1::Progress&) {},
       .on_end = [&](const Outcome& outcome) { ended.set_value(outcome); }});
  EXPECT_EQ(ended.get_future().get().error.reason(), "DATABASE_CORRUPT");
}

TEST_F(LocalExecutorTest, ItsDestructionKillsWhatRunsWithoutAWord) {
  const NamedPipe life(folder_ / "life");
  WriteEvents(ProgressBytes(0.5));
  MakeExecutor("exec 4>\"$here/life\"; cat \"$here/events\" >&3; exec sleep 1000");
  Start(run_);
  ASSERT_TRUE(Happens(run_.progressed));
  executor_.reset();
  EXPECT_TRUE(life.LosesItsWriters());
  EXPECT_EQ(run_.ended.get_future().wait_for(milliseconds(0)), std::future_status::timeout);
}

TEST_F(LocalExecutorTest, WorkersDieWithTheDaemonHoweverItDies) {
  const NamedPipe life(folder_ / "life");
  const NamedPipe started(folder_ / "started");
  const pid_t daemon = fork();
  if (daemon == 0) {
    MakeExecutor("exec 4>\"$here/life\"; echo >\"$here/started\"; exec sleep 1000");
    Start(run_);
    pause();
  }
  ASSERT_TRUE(started.GetsAByte());
  kill(daemon, SIGKILL);
  ASSERT_EQ(waitpid(daemon, nullptr, 0), daemon);
  EXPECT_TRUE(life.LosesItsWriters());
}

}  // namespace
}  // namespace carillon
