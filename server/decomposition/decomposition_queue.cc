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
                                                   const std::string& client) {
  return core_->Submit(request, client);
}

absl::StatusOr<v1::Job> DecompositionQueue::SubmitTransfer(const std::string& model,
                                                           const v1::CreateTransferRequest& request,
                                                           const std::string& client) {
  return core_->SubmitTransfer(model, request, client);
}

DecompositionQueue::Counts DecompositionQueue::counts() { return core_->counts(); }

absl::StatusOr<v1::Job> DecompositionQueue::Get(const std::string& digest) {
  return core_->Get(digest);
}

absl::StatusOr<DecompositionJobPage> DecompositionQueue::List(int page_size,
                                                              const std::string& page_token) {
  return core_->List(page_size, page_token);
}

absl::StatusOr<v1::Job> DecompositionQueue::Cancel(const std::string& digest) {
  return core_->Cancel(digest);
}

absl::StatusOr<std::unique_ptr<JobWatch>> DecompositionQueue::Watch(
    const std::string& digest, std::function<void(const v1::Job&)> on_change) {
  auto watcher = std::make_shared<Watcher>(std::move(on_change));
  RETURN_IF_ERROR(core_->Watch(digest, watcher));
  return std::make_unique<carillon::Watch>(core_, digest, std::move(watcher));
}

absl::Status DecompositionQueue::DeleteModel(const std::string& digest) {
  return core_->DeleteModel(digest);
}

}  // namespace carillon
