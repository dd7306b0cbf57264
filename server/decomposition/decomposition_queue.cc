// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/decomposition_queue.h"

#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/decomposition/queue_core.h"

namespace carillon {
namespace {

class Watch final : public JobWatch {
 public:
  Watch(std::weak_ptr<QueueCore> core, std::string digest, std::shared_ptr<Watcher> watcher)
      : core_(std::move(core)), digest_(std::move(digest)), watcher_(std::move(watcher)) {}
  ~Watch() override {
    watcher_->Close();
    if (const auto core = core_.lock()) core->Forget(digest_, watcher_);
  }

 private:
  std::weak_ptr<QueueCore> core_;
  std::string digest_;
  std::shared_ptr<Watcher> watcher_;
};

class WatchOfAll final : public JobWatch {
 public:
  WatchOfAll(const std::shared_ptr<QueueCore>& core, JobSink& sink) : core_(core), sink_(sink) {
    core->WatchAll(sink);
  }
  ~WatchOfAll() override {
    if (const auto core = core_.lock()) core->Forget(sink_);
  }

 private:
  std::weak_ptr<QueueCore> core_;
  JobSink& sink_;
};

}  // namespace

DecompositionQueue::DecompositionQueue(std::shared_ptr<QueueCore> core) : core_(std::move(core)) {}

DecompositionQueue::~DecompositionQueue() { core_->Stop(); }

const QueueSettings& DecompositionQueue::settings() const { return core_->settings(); }

absl::StatusOr<std::unique_ptr<DecompositionQueue>> DecompositionQueue::Make(
    ModeDatabase& database, std::unique_ptr<Executor> executor, const Clock& clock,
    QueueSettings settings) {
  auto core =
      std::make_shared<QueueCore>(database, std::move(executor), clock, std::move(settings));
  if (const absl::Status status = core->TakeUp(); !status.ok()) {
    core->Stop();
    return status;
  }
  return std::unique_ptr<DecompositionQueue>(new DecompositionQueue(std::move(core)));
}

absl::StatusOr<v1::Job> DecompositionQueue::Submit(const v1::CreateModalModelRequest& request,
                                                   const std::string& client,
                                                   const MaterialCheck& check,
                                                   bool may_change_pinned) {
  return core_->Submit(request, client, check, may_change_pinned);
}

absl::StatusOr<v1::Job> DecompositionQueue::SubmitTransfer(const std::string& model,
                                                           const v1::CreateTransferRequest& request,
                                                           const std::string& client,
                                                           bool may_change_pinned) {
  return core_->SubmitTransfer(model, request, client, may_change_pinned);
}

DecompositionQueue::Counts DecompositionQueue::counts() { return core_->counts(); }

absl::StatusOr<v1::Job> DecompositionQueue::Get(const std::string& digest) {
  return core_->Get(digest);
}

absl::StatusOr<DecompositionJobPage> DecompositionQueue::List(int page_size,
                                                              const std::string& page_token,
                                                              const JobFilter& filter) {
  return core_->List(page_size, page_token, filter);
}

absl::StatusOr<v1::Job> DecompositionQueue::Cancel(const std::string& digest,
                                                   const std::optional<std::string>& client) {
  return core_->Cancel(digest, client);
}

absl::StatusOr<std::unique_ptr<JobWatch>> DecompositionQueue::Watch(
    const std::string& digest, std::function<void(const v1::Job&)> on_change) {
  auto watcher = std::make_shared<Watcher>(std::move(on_change));
  RETURN_IF_ERROR(core_->Watch(digest, watcher));
  return std::make_unique<carillon::Watch>(core_, digest, std::move(watcher));
}

std::unique_ptr<JobWatch> DecompositionQueue::WatchAll(JobSink& sink) {
  return std::make_unique<WatchOfAll>(core_, sink);
}

absl::Status DecompositionQueue::DeleteModel(const std::string& digest) {
  return core_->DeleteModel(digest);
}

}  // namespace carillon
