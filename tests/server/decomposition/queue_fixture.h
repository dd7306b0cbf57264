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

 private:
  static bool HasEnded(const v1::Job& job) { return job.state() >= v1::JOB_STATE_SUCCEEDED; }

  std::mutex mutex_;
  std::condition_variable written_;
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
    const v1::CreateModalModelRequest resolved = *ResolveRequest(SampleRequest(mesh_));
    WriteModel("model10", UnitEigenvalue(resolved, 10'000));
    WriteModel("model20", UnitEigenvalue(resolved, 20'000));
  }

  /// Writes a model that is complete up to an eigenvalue, and was asked for with so many nodes.
  void WriteModel(const std::string& name, double complete_to_eigenvalue, uint32_t node_count = 0,
                  ModalModel model = SampleModel(3, 4)) {
    model.complete_to_eigenvalue = complete_to_eigenvalue;
    auto records = SampleRecords(model);
    records[0].mutable_header()->mutable_settings()->mutable_mesh()->set_target_node_count(
        node_count);
    WriteRecords(folder_ / name, records);
  }

  void Open(const std::string& name) {
    queue_.reset();
    database_.reset();
    database_ = *ModeDatabase::Open(folder_ / name, clock_);
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
    queue_ = *DecompositionQueue::Make(*database_, *MakeLocalExecutor(options_, clock_), clock_,
                                       settings_);
  }

  v1::CreateModalModelRequest Request(double max_frequency_hz, uint32_t node_count = 0) {
    v1::CreateModalModelRequest request = SampleRequest(mesh_);
    request.set_max_frequency_hz(max_frequency_hz);
    request.mutable_settings()->mutable_mesh()->set_target_node_count(node_count);
    return request;
  }

  v1::Job Submit(const v1::CreateModalModelRequest& request, const std::string& client = "") {
    return *queue_->Submit(request, client);
  }

  std::unique_ptr<JobWatch> Watch(const std::string& digest, Diary& diary) {
    return *queue_->Watch(digest, [&diary](const v1::Job& now) { diary.Write(now); });
  }

  v1::Job Await(const std::string& digest, v1::JobState state) {
    Diary diary;
    const auto watch = Watch(digest, diary);
    return diary.Await(state);
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
