// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/decomposition/decomposition_queue.h"
#include "server/decomposition/job/decomposition_request.h"
#include "server/decomposition/worker/local_executor.h"
#include "tests/server/decomposition/scripted_worker.h"

namespace carillon {

inline constexpr std::chrono::seconds kDeadline(60);

inline std::string DigestOf(const v1::Job& job) { return job.name().substr(5); }

/// What a watch was told, for waiting.
class Diary {
 public:
  void Write(const v1::Job& job) {
    const std::lock_guard lock(mutex_);
    if (states_.empty() || states_.back() != job.state()) states_.push_back(job.state());
    last_ = job;
    written_.notify_all();
  }

  template <typename Test>
  v1::Job AwaitThat(Test test) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(written_.wait_for(lock, kDeadline, [&] { return test(last_); }));
    return last_;
  }

  v1::Job Await(v1::JobState state) {
    return AwaitThat([state](const v1::Job& job) { return job.state() == state; });
  }

  v1::Job AwaitEnd() { return AwaitThat(HasEnded); }

  /// Whether the job ends within a time.
  bool EndsWithin(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return written_.wait_for(lock, time, [&] { return HasEnded(last_); });
  }

  std::vector<v1::JobState> states() {
    const std::lock_guard lock(mutex_);
    return states_;
  }

 private:
  static bool HasEnded(const v1::Job& job) { return job.state() >= v1::JOB_STATE_SUCCEEDED; }

  std::mutex mutex_;
  std::condition_variable written_;
  std::vector<v1::JobState> states_;
  v1::Job last_;
};

// Every run of a script appends a line to "runs". The models in the folder are complete up to what
// SampleRequest wants with a maximal frequency of 10 kHz ("model10") and of 20 kHz ("model20").
inline constexpr char kCount[] = "echo $band >>\"$here/runs\"\n";
inline constexpr char kSucceed[] =
    "case $band in *:20000) cp \"$here/model20\" \"$out\";; *) cp \"$here/model10\" \"$out\";; "
    "esac";
inline constexpr char kWaitAtGate[] = "read line <\"$here/gate\"\n";

class DecompositionQueueTest : public ::testing::Test {
 protected:
  DecompositionQueueTest() {
    Open("carillon.db");
    mesh_ = database_->meshes().Put("solid")->digest;
    WriteModel("model10", 10'000);
    WriteModel("model20", 20'000);
    WriteModel("lowered", 5'000, 900);
  }

  void WriteModel(const std::string& name, double frequency_hz, int lowered_from_mode_count = 0) {
    ModalModel model = SampleModel(3, 4);
    model.complete_to_eigenvalue =
        UnitEigenvalue(*ResolveRequest(SampleRequest(mesh_)), frequency_hz);
    auto records = SampleRecords(model);
    records.front().mutable_header()->set_lowered_from_mode_count(
        static_cast<uint32_t>(lowered_from_mode_count));
    WriteRecords(folder_ / name, records);
  }

  void Open(const std::string& name) {
    queue_.reset();
    database_.reset();
    auto database = ModeDatabase::Open(folder_ / name, clock_);
    ASSERT_TRUE(database.ok()) << database.status();
    database_ = *std::move(database);
  }

  void MakeQueue(const std::string& script) {
    queue_.reset();  // which may run the script
    options_.program = WriteWorkerScript(folder_.path(), script);
    StartQueue();
  }

  /// Makes a queue whose worker is the program of the options.
  void StartQueue() {
    queue_.reset();
    options_.directory = folder_ / "running";
    auto executor = MakeLocalExecutor(options_, clock_);
    ASSERT_TRUE(executor.ok()) << executor.status();
    auto queue = DecompositionQueue::Make(*database_, *std::move(executor), clock_, settings_);
    ASSERT_TRUE(queue.ok()) << queue.status();
    queue_ = *std::move(queue);
  }

  v1::CreateModalModelRequest Request(double max_frequency_hz, uint32_t node_count = 0) {
    v1::CreateModalModelRequest request = SampleRequest(mesh_);
    request.set_max_frequency_hz(max_frequency_hz);
    request.mutable_settings()->mutable_mesh()->set_target_node_count(node_count);
    return request;
  }

  v1::Job Submit(const v1::CreateModalModelRequest& request) {
    const auto job = queue_->Submit(request);
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? *job : v1::Job();
  }

  std::unique_ptr<JobWatch> Watch(const std::string& digest, Diary& diary) {
    auto watch = queue_->Watch(digest, [&diary](const v1::Job& now) { diary.Write(now); });
    EXPECT_TRUE(watch.ok()) << watch.status();
    return watch.ok() ? *std::move(watch) : nullptr;
  }
  std::unique_ptr<JobWatch> Watch(const v1::Job& job, Diary& diary) {
    return Watch(DigestOf(job), diary);
  }

  v1::Job AwaitEnd(const std::string& digest) {
    Diary diary;
    const auto watch = Watch(digest, diary);
    return diary.AwaitEnd();
  }
  v1::Job SubmitAndAwaitEnd(const v1::CreateModalModelRequest& request) {
    return AwaitEnd(DigestOf(Submit(request)));
  }

  std::string Runs() { return ReadBytes(folder_ / "runs"); }
  size_t RunCount() { return static_cast<size_t>(std::ranges::count(Runs(), '\n')); }

  TemporaryFolder folder_;
  SystemClock clock_;
  LocalExecutorOptions options_{.worker_count = 1};
  QueueSettings settings_;
  std::string mesh_;
  std::unique_ptr<ModeDatabase> database_;
  std::unique_ptr<DecompositionQueue> queue_;
};

}  // namespace carillon
