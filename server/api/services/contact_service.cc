// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/contact_service.h"

#include <grpcpp/alarm.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/status_conversion.h"
#include "server/api/call/stream_call.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/contact_warnings.h"
#include "server/api/convert/resource_name.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

/// Half of the period of answers that the contract promises.
constexpr std::chrono::milliseconds kAnswerPeriod(500);
/// Time between two looks whether the mixer has taken all impulses, which takes a block. Waiting
/// ends after kMostSettlePeriods, in case the mixer does not render at all.
constexpr std::chrono::milliseconds kSettlePeriod(2);
constexpr int kMostSettlePeriods = 250;
/// Greatest size of a message that gRPC's thread parses and takes at once. Such a message takes up
/// to 2 ms. gRPC has few threads, and all calls wait while these are busy. If another thread took
/// each message of one impulse, a stream would take a third fewer of them in a second.
constexpr size_t kMostBytesAtOnce = size_t{4} << 10;

/// One contact stream. Requests are read one at a time, so only one thread at a time uses
/// `stream_`. An answer is a snapshot, and a newer answer replaces an answer that waits to be sent.
class ContactCall final : public BidiStream<v1::StreamContactsRequest, v1::StreamContactsResponse> {
 public:
  ContactCall(const ContactContext& daemon, TraceRecorders& recorders, ContactWatchers& watchers,
              const grpc::CallbackServerContext& context, Principal caller, ClientPlace place)
      : StreamWriter(nullptr),
        daemon_(daemon),
        recorders_(recorders),
        watchers_(watchers),
        number_(watchers.NumberStream()),
        context_(context),
        caller_(std::move(caller)),
        place_(std::move(place)) {
    StartWriting();
    StartReading();
  }
  ~ContactCall() override {
    recording_.End();
    if (stream_ && watchers_.IsWatched(scene_)) {
      v1::WatchContactsResponse news;
      news.set_ended(true);
      Tell(std::move(news));
    }
  }

 private:
  absl::Status Take(const v1::StreamContactsRequest& request) override {
    if (!request.has_start() && request.steps().empty()) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                     "a request of the stream is empty: set start, or steps");
    }
    if (request.has_start()) RETURN_IF_ERROR(Open(request.start()));
    for (const v1::ContactStep& step : request.steps()) RETURN_IF_ERROR(Step(step));
    return absl::OkStatus();
  }

  bool gone() const override { return context_.IsCancelled(); }

  void RunReading(size_t byte_count, std::function<void()> step) override {
    if (byte_count <= kMostBytesAtOnce) return step();
    daemon_.steps.Run(caller_.client, std::move(step));
  }

  void AllRead() override {
    if (stream_) {
      stream_->intake().Finish();
      TellBlows();
    }
    recording_.End();
    Settle();
  }

  void Refuse(const absl::Status& status) override { CloseWith(status); }

  /// The reading half ends a cancelled call, because reading fails when the client has gone.
  bool ends_by_cancellation() const override { return false; }

  absl::Status Open(const v1::ContactStreamStart& start) {
    if (stream_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                     "the stream was started twice; open another call for another scene");
    }
    ASSIGN_OR_RETURN(scene_, daemon_.owners.Parse(context_, caller_, start.scene()));
    ContactStreamSettings settings;
    settings.step_s = start.step_s();
    if (start.has_scheduling_delay_s()) settings.scheduling_delay_s = start.scheduling_delay_s();
    settings.at_once = start.at_once();
    settings.reading = ToContactReading(start.frame(), start.pulse_shape());
    ASSIGN_OR_RETURN(stream_, daemon_.scenes.OpenContactStream(scene_, settings));
    recording_ = StreamRecording(daemon_.scenes, scene_, start, recorders_.Take(scene_));
    Answer();
    return absl::OkStatus();
  }

  absl::Status Step(const v1::ContactStep& step) {
    if (!stream_) {
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM",
                     "the first request of a contact stream must be start");
    }
    if (recording_.active()) recording_.BeginStep();
    stream_->intake().ListBlowsIn(watchers_.IsWatched(scene_) ? &blows_ : nullptr);
    RETURN_IF_ERROR(ReadStep(step, stream_->intake()));
    TellBlows();
    if (recording_.active()) recording_.AddStep(step, stream_->intake().mapping());
    const bool first = stream_->counts().step_count == 1;
    if (first || daemon_.clock.Monotonic() >= answer_due_) Answer();
    return absl::OkStatus();
  }

  /// Tells the watchers of the scene about the impulses since the last call.
  void TellBlows() {
    if (blows_.empty()) return;
    const double begin_s = static_cast<double>(stream_->intake().mapping().first_frame) /
                           daemon_.output.format().sample_rate_hz;
    v1::WatchContactsResponse news;
    for (BlowRecord& blow : blows_) {
      blow.time_s += begin_s;
      *news.add_blows() = ToProto(blow);
    }
    blows_.clear();
    Tell(std::move(news));
  }

  void Tell(v1::WatchContactsResponse news) {
    news.set_stream(number_);
    watchers_.Tell(scene_, std::move(news));
  }

  /// Ends the call once the mixer has taken all impulses, so that the last counts are final. No
  /// thread waits meanwhile.
  void Settle() {
    if (stream_ && !stream_->settled() && settle_count_++ < kMostSettlePeriods) {
      settle_timer_ = std::make_unique<grpc::Alarm>();
      settle_timer_->Set(std::chrono::system_clock::now() + kSettlePeriod,
                         [this](bool) { Settle(); });
      return;
    }
    if (stream_) Answer();
    CloseWith(absl::OkStatus());
  }

  void Answer() {
    answer_due_ = daemon_.clock.Monotonic() + kAnswerPeriod;
    v1::StreamContactsResponse answer = Snapshot();
    if (watchers_.IsWatched(scene_)) {
      v1::WatchContactsResponse news;
      *news.mutable_report() = answer;
      Tell(std::move(news));
    }
    {
      const MutexLock lock(&mutex_);
      waiting_ = std::move(answer);
    }
    Wake();
  }

  /// Ends the call when the answer that waits has been sent.
  void CloseWith(const absl::Status& status) {
    {
      const MutexLock lock(&mutex_);
      end_ = status;
    }
    Wake();
  }

  absl::StatusOr<Supply> Fill(v1::StreamContactsResponse& response) override {
    const MutexLock lock(&mutex_);
    if (waiting_) {
      response = *std::exchange(waiting_, std::nullopt);
      return Supply::kMessage;
    }
    if (!end_) return Supply::kLater;
    RETURN_IF_ERROR(*end_);
    return Supply::kEnd;
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
    answer.set_remap_count(counts.remap_count);
    answer.set_ahead_s(stream_->ahead_s());
    answer.set_rejected_count(counts.rejected_count);
    if (!stream_->last_rejection().ok()) {
      *answer.mutable_last_rejection() = ToLegibleErrorInfo(stream_->last_rejection());
    }
    const IntakeFindings findings = stream_->findings();
    *answer.mutable_findings() = ToProto(findings);
    AddWarnings(findings, answer);
    return answer;
  }

  const ContactContext daemon_;
  TraceRecorders& recorders_;
  ContactWatchers& watchers_;
  const uint64_t number_;
  uint64_t scene_ = 0;
  std::vector<BlowRecord> blows_;
  StreamRecording recording_;
  const grpc::CallbackServerContext& context_;
  const Principal caller_;
  const ClientPlace place_;
  std::unique_ptr<ContactStream> stream_;
  std::chrono::nanoseconds answer_due_{0};
  int settle_count_ = 0;
  std::unique_ptr<grpc::Alarm> settle_timer_;
  Mutex mutex_;
  std::optional<v1::StreamContactsResponse> waiting_ ABSL_GUARDED_BY(mutex_);
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
};

/// Sends the records of a stream as they are made.
class RecordCall final : public ServerStream<v1::RecordContactsResponse> {
 public:
  RecordCall(TraceRecorders& recorders, const absl::StatusOr<uint64_t>& scene, ClientPlace place)
      : StreamWriter(nullptr), place_(std::move(place)), status_(scene.status()) {
    recorder_ = std::make_shared<TraceRecorder>(scene.value_or(0), [this] { Wake(); });
    if (status_.ok()) recorders.Add(recorder_);
    StartWriting();
  }
  /// The stream may hold the recorder longer than this call lives.
  ~RecordCall() override { recorder_->Leave(); }

 private:
  absl::StatusOr<Supply> Fill(v1::RecordContactsResponse& response) override {
    RETURN_IF_ERROR(status_);
    if (!std::exchange(begun_, true)) return Supply::kMessage;
    if (recorder_->overflowed()) {
      return Refusal(absl::StatusCode::kDataLoss, "RECORDING_TOO_SLOW",
                     "steps of the stream came faster than the client read them, and over 65,536 "
                     "records or 16 MiB waited: record again, and write to a faster disk or over a "
                     "faster network");
    }
    const bool ended = recorder_->ended();
    if (recorder_->TryTake(*response.mutable_record())) return Supply::kMessage;
    return ended ? Supply::kEnd : Supply::kLater;
  }

  const ClientPlace place_;
  const absl::Status status_;
  std::shared_ptr<TraceRecorder> recorder_;
  bool begun_ = false;
};

/// Sends the news of the streams of a scene.
class WatchCall final : public ServerStream<v1::WatchContactsResponse> {
 public:
  WatchCall(ContactWatchers& watchers, const absl::StatusOr<uint64_t>& scene, ClientPlace place)
      : StreamWriter(nullptr), place_(std::move(place)), status_(scene.status()) {
    watcher_ = std::make_shared<ContactWatcher>(scene.value_or(0), [this] { Wake(); });
    if (status_.ok()) watchers.Add(watcher_);
    StartWriting();
  }
  /// A stream may hold the watcher longer than this call lives.
  ~WatchCall() override { watcher_->Leave(); }

 private:
  absl::StatusOr<Supply> Fill(v1::WatchContactsResponse& response) override {
    RETURN_IF_ERROR(status_);
    if (!std::exchange(begun_, true)) return Supply::kMessage;
    return watcher_->TryTake(response) ? Supply::kMessage : Supply::kLater;
  }

  const ClientPlace place_;
  const absl::Status status_;
  std::shared_ptr<ContactWatcher> watcher_;
  bool begun_ = false;
};

}  // namespace

grpc::ServerWriteReactor<v1::WatchContactsResponse>* ContactService::WatchContacts(
    grpc::CallbackServerContext* context, const v1::WatchContactsRequest* request) {
  using Reactor = grpc::ServerWriteReactor<v1::WatchContactsResponse>;
  const auto make = [&](const Principal& caller, ClientPlace place) -> Reactor* {
    return new WatchCall(watchers_, Find(*context, caller, request->scene(), SceneCall::kLooks),
                         std::move(place));
  };
  return Open(*context, daemon_.reception, {Role::kStrike, Holding::kListener}, make);
}

absl::StatusOr<uint64_t> ContactService::Find(const grpc::CallbackServerContext& context,
                                              const Principal& caller, const std::string& name,
                                              SceneCall call) const {
  ASSIGN_OR_RETURN(const uint64_t scene, daemon_.owners.Parse(context, caller, name, call));
  RETURN_IF_ERROR(daemon_.scenes.BusOf(scene).status());
  return scene;
}

grpc::ServerWriteReactor<v1::RecordContactsResponse>* ContactService::RecordContacts(
    grpc::CallbackServerContext* context, const v1::RecordContactsRequest* request) {
  using Reactor = grpc::ServerWriteReactor<v1::RecordContactsResponse>;
  const auto make = [&](const Principal& caller, ClientPlace place) -> Reactor* {
    return new RecordCall(recorders_, Find(*context, caller, request->scene(), SceneCall::kUses),
                          std::move(place));
  };
  return Open(*context, daemon_.reception, {Role::kStrike, Holding::kListener}, make);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::StreamContactsResponse>*
ContactService::StreamContactsRaw(grpc::CallbackServerContext* context) {
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, v1::StreamContactsResponse>;
  return Open(*context, daemon_.reception, {Role::kStrike, Holding::kContactStream},
              [&](const Principal& caller, ClientPlace place) -> Reactor* {
                return new ContactCall(daemon_, recorders_, watchers_, *context, caller,
                                       std::move(place));
              });
}

}  // namespace carillon
