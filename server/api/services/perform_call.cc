// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/perform_call.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/exchange_call.h"
#include "server/api/call/status_conversion.h"
#include "server/api/convert/contact_warnings.h"
#include "server/api/convert/object_conversion.h"
#include "server/api/convert/perform_conversion.h"
#include "server/api/convert/perform_rows.h"
#include "server/api/convert/sample_bytes.h"
#include "server/scene/offline/performance.h"

namespace carillon {
namespace {

/// A message stays below the 4 MiB that gRPC's clients take if they say nothing else.
constexpr size_t kMostSampleBytes = size_t{2} << 20U;
/// Objects for which each environment has room, beside twice those of the settings or first step.
constexpr size_t kMoreObjects = 64;
/// The trailing metadata that has the warnings, as a RenderSummary.
constexpr char kSummaryKey[] = "carillon-summary-bin";

absl::Status Malformed(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "PERFORMANCE_MALFORMED", message);
}

/// Takes the settings, then performs one step after the other. A client that thinks for an hour
/// between two steps keeps its environments.
class PerformCall final : public ExchangeCall<v1::PerformRequest, v1::PerformResponse> {
 public:
  PerformCall(const RenderContext& daemon, grpc::CallbackServerContext& context,
              RenderPlaces places)
      : ExchangeCall(context, daemon.pool), daemon_(daemon), places_(std::move(places)) {
    StartReading();
  }

 private:
  absl::Status Take(const v1::PerformRequest& request) override {
    if (request.has_settings()) return Begin(request.settings());
    if (performance_ == nullptr) return Malformed("the first request has no settings");
    if (request.has_step()) return Step(request.step());
    if (!request.has_reset()) return Malformed("a request has neither settings, reset nor step");
    Reset(request.reset());
    return absl::OkStatus();
  }

  absl::Status AllRead() override {
    ended_ = true;
    return absl::OkStatus();
  }

  absl::Status Begin(const v1::PerformSettings& message) {
    if (performance_ != nullptr) return Malformed("settings were sent twice; they come once");
    ASSIGN_OR_RETURN(settings_, ToEnvironmentSettings(message, daemon_.heads));
    environment_count_ = std::max<size_t>(message.environment_count(), 1);
    first_objects_ = message.objects();
    RETURN_IF_ERROR(Performance::Validate(settings_, environment_count_));
    begins_ = true;
    told_counts_.resize(environment_count_);
    RETURN_IF_ERROR(Make(0));
    return rejections_.status();
  }

  /// Makes the performance, with places for the objects of the settings and `more`.
  absl::Status Make(int more) {
    settings_.most_objects = 2 * static_cast<size_t>(first_objects_.size() + more) + kMoreObjects;
    environment_bytes_ = Performance::EnvironmentBytes(settings_) * environment_count_;
    performance_ = nullptr;
    RETURN_IF_ERROR(GrowMemory());
    ASSIGN_OR_RETURN(performance_,
                     Performance::Make(settings_, environment_count_,
                                       std::max(std::thread::hardware_concurrency(), 1U),
                                       daemon_.bodies, &daemon_.database.transfers()));
    for (const v1::PerformedObject& object : first_objects_) RETURN_IF_ERROR(Add(object));
    CountPaperCoupling();
    return absl::OkStatus();
  }

  /// Steps that add no object leave the number as it is.
  void CountPaperCoupling() {
    paper_count_ = 0;
    for (size_t i = 0; i < performance_->environment_count(); ++i) {
      paper_count_ += performance_->environment(i).paper_coupling_object_count();
    }
  }

  absl::Status GrowMemory() {
    size_t bytes = environment_bytes_;
    for (size_t i = 0; performance_ != nullptr && i < performance_->environment_count(); ++i) {
      bytes += performance_->environment(i).object_bytes();
    }
    return places_.memory.Grow(bytes >> 20U);
  }

  /// Calls `act` with each of the environments of these indices or, if there is none, with all.
  /// Where this fails, it is rejected.
  template <typename Act>
  void ForEach(const google::protobuf::RepeatedField<uint32_t>& indices, const Act& act) {
    const auto call = [&](size_t index) {
      absl::Status done = act(performance_->environment(index));
      if (!done.ok()) rejections_.Add(index, 1, std::move(done));
    };
    const size_t count = performance_->environment_count();
    for (const uint32_t index : indices) {
      if (index < count) {
        call(index);
      } else {
        rejections_.AddStray(
            1, Malformed(absl::StrCat("environment ", index, " is unknown; the performance has ",
                                      count, ", counted from 0")));
      }
    }
    for (size_t i = 0; indices.empty() && i < count; ++i) call(i);
  }

  /// Errors: those of GrowMemory. Others are rejected.
  absl::Status Add(const v1::PerformedObject& added) {
    const absl::StatusOr<ObjectOfModel> object =
        ToObject(added.object(), daemon_.database.models());
    ForEach(added.environments(), [&](Environment& environment) {
      RETURN_IF_ERROR(object.status());
      return environment.AddObject(added.object().handle(), object->model, object->properties);
    });
    return GrowMemory();
  }

  void Reset(const v1::PerformReset& reset) {
    ForEach(reset.environments(), [this](Environment& environment) {
      NoteWarnings(environment);
      return environment.Reset();
    });
    CountPaperCoupling();
  }

  /// Keeps the warnings about the contacts since the last reset. Of several with the same id the
  /// largest one stays.
  void NoteWarnings(const Environment& environment) {
    google::protobuf::RepeatedPtrField<v1::Warning> warnings;
    AddContactWarnings(environment.findings(), environment.accepted_count(), warnings);
    for (const v1::Warning& warning : warnings) {
      v1::Warning& kept = warnings_[warning.id()];
      if (warning.count() >= kept.count()) kept = warning;
    }
  }

  /// Tells the warnings with the end of the call.
  void SendWarnings() {
    for (size_t i = 0; performance_ != nullptr && i < performance_->environment_count(); ++i) {
      NoteWarnings(performance_->environment(i));
    }
    if (warnings_.empty()) return;
    v1::RenderSummary summary;
    for (const auto& [id, warning] : warnings_) *summary.add_warnings() = warning;
    context().AddTrailingMetadata(kSummaryKey, summary.SerializeAsString());
  }

  absl::Status Step(const v1::PerformStep& step) {
    const double time_scale = step.has_time_scale() ? step.time_scale() : 1;
    RETURN_IF_ERROR(performance_->CheckScale(time_scale));
    const int added = step.added_objects_size();
    // Clients add their first objects with the first step.
    if (!std::exchange(has_stepped_, true) && added > static_cast<int>(kMoreObjects / 2)) {
      RETURN_IF_ERROR(Make(added));
    }
    for (const v1::RemovedObject& removed : step.removed_objects()) {
      ForEach(removed.environments(),
              [&](Environment& environment) { return environment.RemoveObject(removed.object()); });
    }
    for (const v1::PerformedObject& object : step.added_objects()) RETURN_IF_ERROR(Add(object));
    if (added > 0) CountPaperCoupling();
    const PerformRows rows(step, *performance_, rejections_);
    samples_ = performance_->Step(
        [&rows](size_t environment, size_t microphone, ContactIntake& intake) {
          rows.Read(environment, microphone, intake);
        },
        time_scale);
    NoteRejections();
    sent_count_ = 0;
    answers_ = true;
    return absl::OkStatus();
  }

  /// Counts what the step rejected, and keeps why its last rejection was.
  void NoteRejections() {
    for (const StepRejections::Rejection& stray : rejections_.strays()) {
      rejected_count_ += stray.count;
      last_rejection_ = stray.why;
    }
    rejections_.Clear();
    for (size_t i = 0; i < told_counts_.size(); ++i) {
      const Environment& environment = performance_->environment(i);
      const uint64_t count = environment.rejected_count();
      if (count == told_counts_[i]) continue;
      rejected_count_ += count - std::exchange(told_counts_[i], count);
      last_rejection_ = About(absl::StrCat("environment ", i), "environment", absl::StrCat(i),
                              environment.last_rejection());
    }
  }

  absl::StatusOr<Supply> Fill(v1::PerformResponse& response) override {
    if (std::exchange(begins_, false)) {
      FillBegun(*response.mutable_begun());
    } else if (answers_) {
      FillSamples(*response.mutable_samples());
    } else {
      if (!ended_) return Supply::kLater;
      SendWarnings();
      return Supply::kEnd;
    }
    return Supply::kMessage;
  }

  void FillBegun(v1::PerformanceBegun& begun) const {
    begun.set_sample_rate_hz(settings_.sample_rate_hz);
    begun.set_channel_count(static_cast<uint32_t>(performance_->channel_count()));
    begun.set_latency_frames(static_cast<uint32_t>(performance_->latency_frames()));
  }

  void FillSamples(v1::PerformedSamples& message) {
    const size_t size = performance_->channel_count() * performance_->frame_count();
    const size_t most =
        std::max<size_t>(kMostSampleBytes / sizeof(float) / std::max<size_t>(size, 1), 1);
    const size_t count = std::min(most, performance_->environment_count() - sent_count_);
    message.set_first_environment(static_cast<uint32_t>(sent_count_));
    message.set_environment_count(static_cast<uint32_t>(count));
    message.set_frame_count(static_cast<uint32_t>(performance_->frame_count()));
    message.set_samples(ToBytes(samples_.subspan(sent_count_ * size, count * size)));
    sent_count_ += count;
    answers_ = sent_count_ < performance_->environment_count();
    message.set_is_last(!answers_);
    message.clear_impacts();
    if (!answers_) FillFindings(message);
  }

  void FillFindings(v1::PerformedSamples& message) {
    for (size_t i = 0; settings_.tells_impacts && i < performance_->environment_count(); ++i) {
      for (const BlowRecord& impact : performance_->environment(i).TakeImpacts()) {
        AddImpact(static_cast<uint32_t>(i), impact, *message.mutable_impacts());
      }
    }
    message.set_paper_coupling_object_count(paper_count_);
    message.set_rejected_count(rejected_count_);
    message.clear_last_rejection();
    if (!last_rejection_.ok())
      *message.mutable_last_rejection() = ToLegibleErrorInfo(last_rejection_);
  }

  const RenderContext daemon_;
  RenderPlaces places_;
  std::unique_ptr<Performance> performance_;
  EnvironmentSettings settings_;
  size_t environment_count_ = 0;
  google::protobuf::RepeatedPtrField<v1::PerformedObject> first_objects_;  // that the settings have
  size_t environment_bytes_ = 0;
  uint32_t paper_count_ = 0;  // objects that sound by the paper's coupling
  bool begins_ = false;       // whether PerformanceBegun is to be sent
  bool has_stepped_ = false;  // whether a step has come
  bool answers_ = false;      // whether samples are to be sent
  bool ended_ = false;
  StepRejections rejections_;          // since the last step
  std::vector<uint64_t> told_counts_;  // rejections of each environment
  uint64_t rejected_count_ = 0;        // of all environments, and of unknown ones
  absl::Status last_rejection_;
  std::map<std::string, v1::Warning> warnings_;  // by id
  std::span<const float> samples_;               // that the newest step rendered
  size_t sent_count_ = 0;                        // environments whose samples were sent
};

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PerformResponse>* MakePerformCall(
    const RenderContext& daemon, grpc::CallbackServerContext& context, RenderPlaces places) {
  return new PerformCall(daemon, context, std::move(places));
}

}  // namespace carillon
