// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_watch.h"

#include <utility>

namespace carillon {
namespace {

class WatchOfOne final : public JobWatch {
 public:
  WatchOfOne(const std::shared_ptr<ActiveJobs>& jobs, std::string digest,
             std::shared_ptr<Watcher> watcher)
      : jobs_(jobs), digest_(std::move(digest)), watcher_(std::move(watcher)) {}
  ~WatchOfOne() override {
    watcher_->Close();
    if (const auto jobs = jobs_.lock()) jobs->Forget(digest_, watcher_);
  }

 private:
  std::weak_ptr<ActiveJobs> jobs_;
  std::string digest_;
  std::shared_ptr<Watcher> watcher_;
};

class WatchOfAll final : public JobWatch {
 public:
  WatchOfAll(const std::shared_ptr<ActiveJobs>& jobs, JobSink& sink) : jobs_(jobs), sink_(sink) {
    jobs->WatchAll(sink);
  }
  ~WatchOfAll() override {
    if (const auto jobs = jobs_.lock()) jobs->Forget(sink_);
  }

 private:
  std::weak_ptr<ActiveJobs> jobs_;
  JobSink& sink_;
};

}  // namespace

std::unique_ptr<JobWatch> MakeJobWatch(const std::shared_ptr<ActiveJobs>& jobs, std::string digest,
                                       std::shared_ptr<Watcher> watcher) {
  return std::make_unique<WatchOfOne>(jobs, std::move(digest), std::move(watcher));
}

std::unique_ptr<JobWatch> MakeJobWatch(const std::shared_ptr<ActiveJobs>& jobs, JobSink& sink) {
  return std::make_unique<WatchOfAll>(jobs, sink);
}

}  // namespace carillon
