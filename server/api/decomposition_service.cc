// SPDX-License-Identifier: Apache-2.0
#include "server/api/decomposition_service.h"

#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "server/api/resource_name.h"
#include "server/api/unary_call.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

bool HasEnded(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_SUCCEEDED || job.state() == v1::JOB_STATE_FAILED ||
         job.state() == v1::JOB_STATE_CANCELLED;
}

/// Sends a job as it changes, one message at a time. Where the client reads slowly, progress that
/// is no longer news is left out.
class JobWatchReactor final : public grpc::ServerWriteReactor<v1::WatchJobResponse> {
 public:
  JobWatchReactor(DecompositionQueue& queue, const absl::StatusOr<std::string>& digest) {
    absl::StatusOr<std::unique_ptr<JobWatch>> watch =
        digest.ok() ? queue.Watch(*digest, [this](const v1::Job& job) { OnChange(job); })
                    : digest.status();
    const MutexLock lock(&mutex_);
    if (watch.ok()) {
      watch_ = *std::move(watch);
    } else {
      finished_ = true;
      Finish(ToGrpcStatus(watch.status()));
    }
  }

  void OnWriteDone(bool ok) override {
    const MutexLock lock(&mutex_);
    writing_ = false;
    if (!ok || cancelled_) return End(grpc::Status::CANCELLED);
    if (HasEnded(response_.job())) return End(grpc::Status::OK);
    Next();
  }

  void OnCancel() override {
    const MutexLock lock(&mutex_);
    cancelled_ = true;
    if (!writing_) End(grpc::Status::CANCELLED);
  }

  void OnDone() override { delete this; }

 private:
  void OnChange(const v1::Job& job) {
    const MutexLock lock(&mutex_);
    if (!waiting_.empty() && waiting_.back().state() == job.state()) waiting_.pop_back();
    waiting_.push_back(job);
    Next();
  }

  void Next() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (writing_ || finished_ || waiting_.empty()) return;
    *response_.mutable_job() = std::move(waiting_.front());
    waiting_.pop_front();
    writing_ = true;
    StartWrite(&response_);
  }

  void End(const grpc::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  Mutex mutex_;
  v1::WatchJobResponse response_;  // gRPC's while writing_
  std::deque<v1::Job> waiting_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  /// Last, so that it ends before what OnChange touches.
  std::unique_ptr<JobWatch> watch_;
};

}  // namespace

grpc::ServerUnaryReactor* DecompositionService::GetJob(grpc::CallbackServerContext* context,
                                                       const v1::GetJobRequest* request,
                                                       v1::GetJobResponse* response) {
  return Answer(context, pool_, [this, request, response] {
    const absl::StatusOr<std::string> digest = ParseJobName(request->name());
    if (!digest.ok()) return digest.status();
    absl::StatusOr<v1::Job> job = queue_.Get(*digest);
    if (!job.ok()) return job.status();
    *response->mutable_job() = *std::move(job);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* DecompositionService::ListJobs(grpc::CallbackServerContext* context,
                                                         const v1::ListJobsRequest* request,
                                                         v1::ListJobsResponse* response) {
  return Answer(context, pool_, [this, request, response] {
    absl::StatusOr<DecompositionJobPage> page =
        queue_.List(request->page_size(), request->page_token());
    if (!page.ok()) return page.status();
    for (v1::Job& job : page->jobs) *response->add_jobs() = std::move(job);
    response->set_next_page_token(page->next_page_token);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* DecompositionService::CancelJob(grpc::CallbackServerContext* context,
                                                          const v1::CancelJobRequest* request,
                                                          v1::CancelJobResponse* response) {
  return Answer(context, pool_, [this, request, response] {
    const absl::StatusOr<std::string> digest = ParseJobName(request->name());
    if (!digest.ok()) return digest.status();
    absl::StatusOr<v1::Job> job = queue_.Cancel(*digest);
    if (!job.ok()) return job.status();
    *response->mutable_job() = *std::move(job);
    return absl::OkStatus();
  });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* DecompositionService::WatchJob(
    grpc::CallbackServerContext*, const v1::WatchJobRequest* request) {
  return new JobWatchReactor(queue_, ParseJobName(request->name()));
}

}  // namespace carillon
