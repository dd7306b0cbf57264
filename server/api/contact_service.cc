// SPDX-License-Identifier: Apache-2.0
#include "server/api/contact_service.h"

#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "proto/cpp/error_reason.h"
#include "server/api/contact_conversion.h"
#include "server/api/resource_name.h"
#include "server/api/status_conversion.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

/// Half of what the contract promises.
constexpr std::chrono::milliseconds kAnswerPeriod(500);
/// The mixer takes what was pushed within a block; waiting ends if it does not render at all.
constexpr std::chrono::milliseconds kSettlePeriod(2);
constexpr int kMostSettlePeriods = 250;

/// One contact stream. Reads one request at a time, so only one thread at a time touches `stream_`;
/// answers are snapshots that wait until the last has gone.
class ContactReactor final
    : public grpc::ServerBidiReactor<v1::StreamContactsRequest, v1::StreamContactsResponse> {
 public:
  explicit ContactReactor(const ContactContext& daemon) : daemon_(daemon) { StartRead(&request_); }

  void OnReadDone(bool ok) override {
    if (!ok) {
      daemon_.pool.Run([this] { Settle(); });
      return;
    }
    if (absl::Status status = Take(); !status.ok()) return End(ToGrpcStatus(status));
    StartRead(&request_);
  }

  void OnWriteDone(bool ok) override {
    std::optional<grpc::Status> end;
    {
      const MutexLock lock(&mutex_);
      writing_ = false;
      if (!ok) waiting_.reset();
      end = Advance();
    }
    if (end) Finish(*end);
  }

  void OnDone() override { delete this; }

 private:
  absl::Status Take() {
    switch (request_.request_case()) {
      case v1::StreamContactsRequest::kStart:
        return Open(request_.start());
      case v1::StreamContactsRequest::kStep:
        return Step(request_.step());
      default:
        return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                       "a request is neither start nor step");
    }
  }

  absl::Status Open(const v1::ContactStreamStart& start) {
    if (stream_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                     "the stream was started twice; open another call for another scene");
    }
    const absl::StatusOr<uint64_t> scene = ParseSceneName(start.scene());
    if (!scene.ok()) return scene.status();
    ContactStreamSettings settings;
    settings.step_s = start.step_s();
    if (start.has_scheduling_delay_s()) settings.scheduling_delay_s = start.scheduling_delay_s();
    absl::StatusOr<std::unique_ptr<ContactStream>> stream =
        daemon_.scenes.OpenContactStream(*scene, settings);
    if (!stream.ok()) return stream.status();
    stream_ = *std::move(stream);
    Answer();
    return absl::OkStatus();
  }

  absl::Status Step(const v1::ContactStep& step) {
    if (!stream_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "STREAM_NOT_STARTED",
                     "the first request of a contact stream must be start");
    }
    if (absl::Status status = stream_->BeginStep(step.time_s()); !status.ok()) return status;
    ReadStep(
        step,
        {.move = [this](uint32_t handle, const Pose& pose) { stream_->Move(handle, pose); },
         .move_listener = [this](const Pose& pose) { stream_->MoveListener(pose); },
         .strike = [this](const ObjectImpulse& impulse) { stream_->Strike(impulse); },
         .hold = [this](const ObjectForce& force) { stream_->Hold(force); },
         .touch = [this](const ObjectTouch& touch) { stream_->Touch(touch); },
         .reject = [this](uint64_t count,
                          absl::Status reason) { stream_->Reject(count, std::move(reason)); }});
    stream_->EndStep();
    const bool first = stream_->counts().step_count == 1;
    if (first || daemon_.clock.Monotonic() >= answer_due_) Answer();
    return absl::OkStatus();
  }

  /// The client has said all: wait until the mixer has taken it, so that the last counts are whole.
  void Settle() {
    for (int i = 0; stream_ && !stream_->settled() && i < kMostSettlePeriods; ++i) {
      daemon_.clock.SleepUntil(daemon_.clock.Monotonic() + kSettlePeriod);
    }
    if (stream_) Answer();
    End(grpc::Status::OK);
  }

  void Answer() {
    answer_due_ = daemon_.clock.Monotonic() + kAnswerPeriod;
    v1::StreamContactsResponse answer = Snapshot();
    const MutexLock lock(&mutex_);
    waiting_ = std::move(answer);
    Advance();  // never the end: that comes after the last answer
  }

  v1::StreamContactsResponse Snapshot() const {
    const ContactCounts counts = stream_->counts();
    v1::StreamContactsResponse answer;
    answer.set_scheduling_delay_s(stream_->scheduling_delay_s());
    answer.set_output_latency_s(daemon_.output.state().latency_s);
    if (const auto frame = stream_->first_frame()) answer.set_first_frame(*frame);
    answer.set_step_count(counts.step_count);
    answer.set_accepted_count(counts.accepted_count);
    answer.set_late_count(counts.late_count);
    answer.set_dropped_count(counts.dropped_count);
    answer.set_rejected_count(counts.rejected_count);
    if (!stream_->last_rejection().ok()) {
      *answer.mutable_last_rejection() = ToErrorInfo(stream_->last_rejection());
    }
    return answer;
  }

  void End(const grpc::Status& status) {
    std::optional<grpc::Status> end;
    {
      const MutexLock lock(&mutex_);
      end_ = status;
      end = Advance();
    }
    if (end) Finish(*end);
  }

  /// Sends what waits. Returns the status with which to finish where nothing is left to send: the
  /// caller does that without the lock, as its last deed, since this may be deleted at once.
  std::optional<grpc::Status> Advance() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (writing_) return std::nullopt;
    if (!waiting_) return std::exchange(end_, std::nullopt);
    answer_ = *std::exchange(waiting_, std::nullopt);
    writing_ = true;
    StartWrite(&answer_);
    return std::nullopt;
  }

  const ContactContext daemon_;
  v1::StreamContactsRequest request_;
  std::unique_ptr<ContactStream> stream_;
  std::chrono::nanoseconds answer_due_{0};
  Mutex mutex_;
  v1::StreamContactsResponse answer_;  // gRPC's while writing_
  std::optional<v1::StreamContactsResponse> waiting_ ABSL_GUARDED_BY(mutex_);
  std::optional<grpc::Status> end_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace

grpc::ServerBidiReactor<v1::StreamContactsRequest, v1::StreamContactsResponse>*
ContactService::StreamContacts(grpc::CallbackServerContext*) {
  return new ContactReactor(daemon_);
}

}  // namespace carillon
