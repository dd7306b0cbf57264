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
#include <tuple>
#include <vector>

#include "server/base/sha256.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/worker/worker_events.h"
#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
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
  void MakeExecutor(const std::string& script) { MakeExecutor(script, clock_); }

  void MakeExecutor(const std::string& script, const Clock& clock) {
    options_.program = WriteWorkerScript(folder_.path(), script);
    options_.directory = folder_ / "running";
    executor_ = *MakeLocalExecutor(options_, clock);
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

  void Start(TaskRun& run, const std::string& digest = Sha256Hex("task")) {
    executor_->Start({.digest = digest,
                      .radiates = radiates_,
                      .request = request_,
                      .way = 0,
                      .write_input =
                          [this](const std::filesystem::path& file) {
                            WriteBytes(file, "solid");
                            return input_;
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
  absl::Status input_;     // of the tasks that start
  LocalExecutorOptions options_;
  const std::string digest_ = Sha256Hex("task");
  v1::CreateModalModelRequest request_ = *ResolveRequest(SampleRequest(Sha256Hex("solid")));
  TaskRun run_;
  std::unique_ptr<Executor> executor_;
};

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
  EXPECT_THAT(run_.fractions, ElementsAre(0.5, 0.5, 0.5, 0.5, 1));
}

TEST_F(LocalExecutorTest, ACrashIsReportedWithTheLastWords) {
  const Outcome outcome = RunScript("echo 'segment 7 is \xff bad' >&2; kill -SEGV $$");
  EXPECT_EQ(outcome.verdict, Verdict::kCrashed);
  EXPECT_EQ(outcome.error.reason(), "WORKER_CRASHED");
  EXPECT_THAT(outcome.error.message(), HasSubstr("signal 11"));
  EXPECT_THAT(outcome.error.message(), HasSubstr("segment 7 is   bad"));
}

TEST_F(LocalExecutorTest, AKillIsTheKernelsForLackOfMemoryIfTheKernelSaysSo) {
  options_.kernel_counts = folder_ / "vmstat";
  worker::v1::WorkerEvent event;
  event.mutable_progress()->set_node_count(1'000'000);
  WriteEvents(EventBytes(event));
  WriteBytes(options_.kernel_counts, "pgfault 7\noom_kill 3\nballoon_inflate 0\n");
  const Outcome outcome =
      RunScript("cat \"$here/events\" >&3; echo 'oom_kill 4' >\"$here/vmstat\"; kill -KILL $$");
  EXPECT_TRUE(outcome.killed);
  EXPECT_EQ(outcome.verdict, Verdict::kOutOfMemory);
  EXPECT_EQ(outcome.error.reason(), "OUT_OF_MEMORY");
  EXPECT_THAT(outcome.error.message(), HasSubstr("with its 1000000 nodes it would need about 62"));
}

TEST_F(LocalExecutorTest, AKillWithoutALackOfMemoryIsSomebodyElses) {
  options_.kernel_counts = folder_ / "vmstat";
  WriteBytes(options_.kernel_counts, "oom_kill 3\n");
  const Outcome outcome = RunScript("kill -KILL $$");
  EXPECT_TRUE(outcome.killed);
  EXPECT_EQ(outcome.verdict, Verdict::kCrashed);
  EXPECT_EQ(outcome.error.reason(), "WORKER_CRASHED");
}

TEST_F(LocalExecutorTest, KillsAWorkerThatTakesMoreMemoryThanTheLowerOfTwoLimits) {
  for (const auto& [option_mib, request_mib, limit] :
       {std::tuple(100, 0, "100 MiB"), {100, 50, "50 MiB"}, {0, 50, "50 MiB"}}) {
    SCOPED_TRACE(limit);
    executor_.reset();  // before what it tells
    run_ = TaskRun();
    options_.memory_limit_bytes = option_mib << 20;
    request_.set_memory_limit_bytes(request_mib << 20);
    // Doubled until it is killed.
    const Outcome outcome = RunScript("x=0123456789abcdef; while :; do x=$x$x; done");
    EXPECT_EQ(outcome.verdict, Verdict::kOutOfMemory);
    EXPECT_THAT(outcome.error.message(), HasSubstr(limit));
    EXPECT_GT(outcome.peak_bytes, 50U << 20);
    EXPECT_FALSE(outcome.crowded);
  }
}

TEST_F(LocalExecutorTest, WhereAllTogetherTakeTooMuchATransferMakesRoomAndElseTheYoungest) {
  for (const bool first_radiates : {false, true}) {
    TaskRun first, second;
    MakeCrowdedExecutor();
    radiates_ = first_radiates;
    Start(first, digest_);
    ASSERT_TRUE(Happens(first.progressed));
    radiates_ = false;
    Start(second, Sha256Hex("second"));
    TaskRun& yields = first_radiates ? first : second;
    ASSERT_TRUE(Happens(yields.ended));
    EXPECT_EQ(yields.outcome.verdict, Verdict::kOutOfMemory);
    EXPECT_TRUE(yields.outcome.crowded);
    executor_->Cancel(first_radiates ? Sha256Hex("second") : digest_);
    TaskRun& stays = first_radiates ? second : first;
    ASSERT_TRUE(Happens(stays.ended));
    EXPECT_EQ(stays.outcome.verdict, Verdict::kCancelled);
    executor_.reset();  // before what it tells
  }
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
  options_.stall_limit = std::chrono::minutes(10);
  MakeExecutor(
      "cat \"$here/events\" >&3; until [ -e \"$here/go\" ]; do :; done; echo sound >\"$out\"",
      clock);
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

TEST_F(LocalExecutorTest, AMeshThatCannotBeBroughtEndsTheTask) {
  input_ = absl::DataLossError("DATABASE_CORRUPT: x");
  EXPECT_EQ(RunScript("true").error.reason(), "DATABASE_CORRUPT");
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

TEST(WorkerEvents, AreTheSameHoweverTheBytesAreCut) {
  const std::string bytes =
      ProgressBytes(0.25) + ProgressBytes(0.5) + ErrorBytes("MESH_NOT_CLOSED");
  for (size_t piece = 1; piece <= bytes.size(); ++piece) {
    WorkerEventReader reader;
    std::vector<double> fractions;
    std::vector<std::string> reasons;
    for (size_t at = 0; at < bytes.size(); at += piece) {
      ASSERT_TRUE(reader
                      .Feed(std::string_view(bytes).substr(at, piece),
                            [&](const worker::v1::WorkerEvent& event) {
                              if (event.has_error()) reasons.push_back(event.error().reason());
                              if (event.has_progress()) {
                                fractions.push_back(event.progress().fraction());
                              }
                            })
                      .ok());
    }
    EXPECT_THAT(fractions, ElementsAre(0.25, 0.5));
    EXPECT_THAT(reasons, ElementsAre("MESH_NOT_CLOSED"));
  }
}

TEST(WorkerEvents, RefusesGarbageWithoutKeepingIt) {
  const std::vector<std::string> garbage = {
      std::string(6, '\xff'),              // a length of no end
      std::string("\x80\x80\x80\x01", 4),  // a length of 2 MiB
      std::string(1, '\0'),                // an event that says nothing
      "\004text",                          // no protobuf
      "\x05\x12\x03\x0a\x01\xff",          // a reason that is no UTF-8
  };
  for (const std::string& bytes : garbage) {
    WorkerEventReader reader;
    EXPECT_TRUE(absl::IsDataLoss(reader.Feed(bytes, [](const worker::v1::WorkerEvent&) {})));
  }
}

}  // namespace
}  // namespace carillon
