// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/contact_stream_call.h"

#include <grpcpp/support/client_callback.h>

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "client_sdk/cpp/internal/step_time.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

/// A message has some bytes around a step.
constexpr size_t kMostStepBytes = kMaxMessageBytes - 64;
/// Steps that wait are sent together up to this size and number. The cost of a message is then
/// small beside that of its steps, and Send() waits only briefly while they are put together.
constexpr size_t kMostBytesTogether = size_t{64} << 10U;
constexpr size_t kMostStepsTogether = 256;

/// A call of StreamContacts, driven by gRPC's reactor.
///
/// At most one write is in progress, that of `written_`; the next one, that of the steps at the
/// front of `queue_`, starts when it is done. Because Send() starts writes from outside the
/// reactor, a hold keeps gRPC from ending the call between two writes; the hold is released once,
/// when no further write can start. A read of the next answer is always in progress until the
/// daemon ends the stream.
class ContactStreamCall final
    : public ContactStream,
      public grpc::ClientBidiReactor<v1::StreamContactsRequest, v1::StreamContactsResponse> {
 public:
  ContactStreamCall(std::string server, std::unique_ptr<grpc::ClientContext> context)
      : server_(std::move(server)), context_(std::move(context)) {}

  ~ContactStreamCall() override {
    context_->TryCancel();
    absl::MutexLock lock(&mutex_);
    if (started_) mutex_.Await(absl::Condition(this, &ContactStreamCall::Done));
  }

  absl::Status Open(v1::ContactService::Stub& stub, const v1::ContactStreamStart& start) {
    stub.async()->StreamContacts(context_.get(), this);
    {
      absl::MutexLock lock(&mutex_);
      started_ = true;
      AddHold();
      StartRead(&answer_);
      *written_.mutable_start() = start;
      writing_ = true;
      StartWrite(&written_);
    }
    StartCall();
    absl::MutexLock lock(&mutex_);
    mutex_.Await(absl::Condition(this, &ContactStreamCall::AnsweredOrDone));
    return answered_ ? absl::OkStatus() : EndedLocked();
  }

  absl::Status Send(v1::ContactStep step) override {
    const size_t byte_count = step.ByteSizeLong();
    if (byte_count > kMostStepBytes) {
      return Refusal(absl::StatusCode::kInvalidArgument, "STEP_TOO_LARGE",
                     absl::StrCat("a step of ", byte_count, " bytes: the daemon takes at most ",
                                  kMostStepBytes, "; report fewer points"));
    }
    absl::MutexLock lock(&mutex_);
    if (!holding_) {
      mutex_.Await(absl::Condition(this, &ContactStreamCall::Done));
      return EndedLocked();
    }
    RETURN_IF_ERROR(
        CheckStepTime({.number = step_count_, .time_s = step.time_s(), .previous_s = time_s_}, "",
                      "open another stream"));
    ++step_count_;
    time_s_ = step.time_s();
    if (queue_.size() >= kMaxQueuedSteps) {
      queue_.pop_front();
      ++dropped_step_count_;
    }
    queue_.push_back({.step = std::move(step), .byte_count = byte_count});
    if (!writing_) WriteNextLocked();
    return absl::OkStatus();
  }

  size_t WaitingStepCount() const override {
    absl::MutexLock lock(&mutex_);
    return queue_.size() + (writing_ ? written_step_count_ : 0);
  }

  uint64_t DroppedStepCount() const override {
    absl::MutexLock lock(&mutex_);
    return dropped_step_count_;
  }

  v1::StreamContactsResponse Report() const override {
    absl::MutexLock lock(&mutex_);
    return ReportLocked();
  }

  absl::StatusOr<v1::StreamContactsResponse> Finish() override {
    absl::MutexLock lock(&mutex_);
    finishing_ = true;
    if (holding_ && queue_.empty() && !writing_) EndWritesLocked();
    mutex_.Await(absl::Condition(this, &ContactStreamCall::Done));
    if (!status_->ok()) return *status_;
    return ReportLocked();
  }

 private:
  struct QueuedStep {
    v1::ContactStep step{};
    size_t byte_count = 0;
  };

  void OnWriteDone(bool ok) override {
    absl::MutexLock lock(&mutex_);
    writing_ = false;
    if (!holding_) return;
    if (!ok) {
      ReleaseHoldLocked();
    } else if (!queue_.empty()) {
      WriteNextLocked();
    } else if (finishing_) {
      EndWritesLocked();
    }
  }

  void OnReadDone(bool ok) override {
    absl::MutexLock lock(&mutex_);
    if (!ok) {
      ReleaseHoldLocked();
      return;
    }
    report_ = std::move(answer_);
    answered_ = true;
    StartRead(&answer_);
  }

  void OnDone(const grpc::Status& status) override {
    const absl::Status result = FromRpc(status, server_);
    absl::MutexLock lock(&mutex_);
    status_ = result;
  }

  /// Returns the daemon's newest answer, with the warning that only the client can give.
  v1::StreamContactsResponse ReportLocked() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    v1::StreamContactsResponse report = report_;
    if (dropped_step_count_ > 0) {
      v1::Warning& warning = *report.add_warnings();
      warning.set_id("STEPS_DROPPED");
      warning.set_count(dropped_step_count_);
      warning.set_text(absl::StrCat(
          dropped_step_count_, dropped_step_count_ == 1 ? " step was" : " steps were",
          " not sent, because too many waited for the network; send fewer steps in one second, or "
          "smaller ones"));
    }
    return report;
  }

  /// Returns the number of waiting steps that the next message takes.
  size_t CountTogetherLocked() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    size_t count = 1, byte_count = queue_.front().byte_count;
    while (count < std::min(queue_.size(), kMostStepsTogether)) {
      byte_count += queue_[count].byte_count;
      if (byte_count > kMostBytesTogether) break;
      ++count;
    }
    return count;
  }

  v1::ContactStep TakeStepLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    v1::ContactStep step = std::move(queue_.front().step);
    queue_.pop_front();
    return step;
  }

  void WriteNextLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    written_step_count_ = CountTogetherLocked();
    written_.Clear();
    for (size_t i = 0; i < written_step_count_; ++i) *written_.add_steps() = TakeStepLocked();
    writing_ = true;
    StartWrite(&written_);
  }

  void EndWritesLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    StartWritesDone();
    ReleaseHoldLocked();
  }

  void ReleaseHoldLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (std::exchange(holding_, false)) RemoveHold();
  }

  absl::Status EndedLocked() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (!status_->ok()) return *status_;
    return Refusal(absl::StatusCode::kFailedPrecondition, "CONTACT_STREAM_ENDED",
                   "the stream has ended; open another one");
  }

  bool Done() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return status_.has_value(); }
  bool AnsweredOrDone() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { return answered_ || Done(); }

  const std::string server_;
  const std::unique_ptr<grpc::ClientContext> context_;
  v1::StreamContactsResponse answer_;    ///< belongs to the read in progress
  v1::StreamContactsRequest written_{};  ///< belongs to the write in progress
  mutable absl::Mutex mutex_;
  std::deque<QueuedStep> queue_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  size_t written_step_count_ ABSL_GUARDED_BY(mutex_) = 0;  ///< of `written_`
  uint64_t step_count_ ABSL_GUARDED_BY(mutex_) = 0;        ///< steps that Send() has taken
  double time_s_ ABSL_GUARDED_BY(mutex_) = 0;              ///< of the newest of them
  uint64_t dropped_step_count_ ABSL_GUARDED_BY(mutex_) = 0;
  v1::StreamContactsResponse report_ ABSL_GUARDED_BY(mutex_);
  std::optional<absl::Status> status_ ABSL_GUARDED_BY(mutex_);
  bool started_ ABSL_GUARDED_BY(mutex_) = false;
  bool holding_ ABSL_GUARDED_BY(mutex_) = true;
  bool answered_ ABSL_GUARDED_BY(mutex_) = false;
  bool finishing_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<ContactStream>> OpenContactStream(
    v1::ContactService::Stub& stub, const std::string& server,
    std::unique_ptr<grpc::ClientContext> context, const v1::ContactStreamStart& start) {
  auto call = std::make_unique<ContactStreamCall>(server, std::move(context));
  RETURN_IF_ERROR(call->Open(stub, start));
  return call;
}

}  // namespace carillon::client
