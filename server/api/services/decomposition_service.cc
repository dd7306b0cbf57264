// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/decomposition_service.h"

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/stream_call.h"
#include "server/api/call/unary_call.h"
#include "server/api/convert/resource_name.h"
#include "server/base/mutex.h"
#include "server/decomposition/job/job_rules.h"

namespace carillon {
namespace {

bool HasEnded(const v1::Job& job) {
  return job.state() == v1::JOB_STATE_SUCCEEDED || job.state() == v1::JOB_STATE_FAILED ||
         job.state() == v1::JOB_STATE_CANCELLED;
}

/// Sends a job whenever it changes. A client that reads slowly gets only the newest progress of
/// each state, and only the newest kMostWaiting states.
class JobWatchCall final : public ServerStream<v1::WatchJobResponse> {
 public:
  JobWatchCall(DecompositionQueue& queue, const absl::StatusOr<std::string>& digest)
      : StreamWriter(nullptr) {
    if (digest.ok()) {
      watch_ = queue.Watch(*digest, [this](const v1::Job& job) { OnChange(job); });
    } else {
      watch_ = digest.status();
    }
    StartWriting();
  }

 private:
  static constexpr size_t kMostWaiting = 16;

  void OnChange(const v1::Job& job) {
    {
      const MutexLock lock(&mutex_);
      if (!waiting_.empty() && waiting_.back().state() == job.state()) waiting_.pop_back();
      if (waiting_.size() == kMostWaiting) waiting_.pop_front();
      waiting_.push_back(job);
    }
    Wake();
  }

  absl::StatusOr<Supply> Fill(v1::WatchJobResponse& response) override {
    RETURN_IF_ERROR(watch_.status());
    if (HasEnded(response.job())) return Supply::kEnd;
    const MutexLock lock(&mutex_);
    if (waiting_.empty()) return Supply::kLater;
    *response.mutable_job() = std::move(waiting_.front());
    waiting_.pop_front();
    return Supply::kMessage;
  }

  Mutex mutex_;
  std::deque<v1::Job> waiting_ ABSL_GUARDED_BY(mutex_);
  /// The last member, so that it is destroyed first, and OnChange is not called afterwards.
  absl::StatusOr<std::unique_ptr<JobWatch>> watch_;
};

/// The filter of a ListJobsRequest or a WatchJobsRequest, whose fields have the same names.
template <typename Message>
JobFilter FilterOf(const Message& request) {
  JobFilter filter{.label_contains = request.label_contains()};
  for (const int state : request.states()) {
    filter.states.push_back(static_cast<v1::JobState>(state));
  }
  return filter;
}

/// Sends the jobs that match whenever they change. While a job waits to be sent, only its newest
/// state is kept.
class JobsWatchCall final : public ServerStream<v1::WatchJobsResponse>, private JobSink {
 public:
  JobsWatchCall(DecompositionQueue& queue, JobFilter filter, ThreadPool& pool)
      : StreamWriter(&pool), filter_(std::move(filter)), watch_(queue.WatchAll(*this)) {
    StartWriting();
  }

 private:
  static constexpr size_t kMostWaiting = 4096;

  // Called while the queue holds its lock. Wake hands the writing to the pool, so this thread makes
  // no call of the queue.
  void Take(const v1::Job& job) override {
    if (!Matches(job, filter_)) return;
    {
      const MutexLock lock(&mutex_);
      if (waiting_.size() < kMostWaiting || waiting_.contains(job.name())) {
        if (!waiting_.contains(job.name())) order_.push_back(job.name());
        waiting_[job.name()] = job;
      } else {
        overrun_ = true;
      }
    }
    Wake();
  }

  void TakeBegin() override {
    {
      const MutexLock lock(&mutex_);
      order_.emplace_back();
    }
    Wake();
  }

  absl::StatusOr<Supply> Fill(v1::WatchJobsResponse& response) override {
    const MutexLock lock(&mutex_);
    if (overrun_) {
      return Refusal(absl::StatusCode::kDataLoss, "WATCH_TOO_SLOW",
                     absl::StrCat("the client did not read, and changes of over ", kMostWaiting,
                                  " jobs wait for it: watch again, and read at once"));
    }
    if (order_.empty()) return Supply::kLater;
    response.Clear();
    if (auto job = waiting_.extract(order_.front())) {
      *response.mutable_job() = std::move(job.mapped());
    }
    order_.pop_front();
    return Supply::kMessage;
  }

  const JobFilter filter_;
  Mutex mutex_;
  /// Names in the order of sending. An empty name stands for the start of the changes.
  std::deque<std::string> order_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, v1::Job> waiting_ ABSL_GUARDED_BY(mutex_);
  bool overrun_ ABSL_GUARDED_BY(mutex_) = false;
  /// The last member, so that it is destroyed first, and Take is not called afterwards.
  const std::unique_ptr<JobWatch> watch_;
};

}  // namespace

grpc::ServerUnaryReactor* DecompositionService::GetJob(grpc::CallbackServerContext* context,
                                                       const v1::GetJobRequest* request,
                                                       v1::GetJobResponse* response) {
  return Answer(context, reception_, Role::kAny, [this, request, response] {
    ASSIGN_OR_RETURN(const std::string digest, ParseJobName(request->name()));
    ASSIGN_OR_RETURN(*response->mutable_job(), queue_.Get(digest));
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* DecompositionService::ListJobs(grpc::CallbackServerContext* context,
                                                         const v1::ListJobsRequest* request,
                                                         v1::ListJobsResponse* response) {
  return Answer(context, reception_, Role::kAny, [this, request, response] {
    ASSIGN_OR_RETURN(DecompositionJobPage page,
                     queue_.List(request->page_size(), request->page_token(), FilterOf(*request)));
    for (v1::Job& job : page.jobs) *response->add_jobs() = std::move(job);
    response->set_next_page_token(page.next_page_token);
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* DecompositionService::CancelJob(grpc::CallbackServerContext* context,
                                                          const v1::CancelJobRequest* request,
                                                          v1::CancelJobResponse* response) {
  return Answer(
      context, writing_, Role::kSubmit, [this, request, response](const Principal& caller) {
        ASSIGN_OR_RETURN(const std::string digest, ParseJobName(request->name()));
        ASSIGN_OR_RETURN(const v1::Job before, queue_.Get(digest));
        const bool for_all = caller.has(Role::kAdminister) && !request->only_for_caller();
        ASSIGN_OR_RETURN(
            *response->mutable_job(),
            queue_.Cancel(digest, for_all ? std::nullopt : std::optional(caller.client)));
        // Neither call changes a job that has ended. A running job that the second call cancels is
        // still shown as running.
        const v1::JobState state = response->job().state();
        const bool ended = state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED;
        if (HasEnded(before) || ended) return absl::OkStatus();
        writing_.events.LogLimited(
            Event("job_cancelled").With("job", before.name()).WithSome("label", before.label()),
            caller);
        return absl::OkStatus();
      });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* DecompositionService::WatchJob(
    grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) {
  return Open(*context, reception_, Role::kAny,
              [this, request]() -> grpc::ServerWriteReactor<v1::WatchJobResponse>* {
                return new JobWatchCall(queue_, ParseJobName(request->name()));
              });
}

grpc::ServerWriteReactor<v1::WatchJobsResponse>* DecompositionService::WatchJobs(
    grpc::CallbackServerContext* context, const v1::WatchJobsRequest* request) {
  return Open(*context, reception_, Role::kAny,
              [this, request]() -> grpc::ServerWriteReactor<v1::WatchJobsResponse>* {
                return new JobsWatchCall(queue_, FilterOf(*request), reception_.pool);
              });
}

}  // namespace carillon
