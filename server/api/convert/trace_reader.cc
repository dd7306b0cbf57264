// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/trace_reader.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/limits.h"
#include "proto/cpp/shortest_decimal.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/object_conversion.h"
#include "server/api/convert/pose_conversion.h"
#include "server/api/convert/resource_name.h"
#include "server/scene/contact_stream.h"

namespace carillon {
namespace {

constexpr uint32_t kFormatVersion = 1;
constexpr uint64_t kMostFirstFrame = uint64_t{1} << 48;
/// Steps by whose intervals the unit of time is judged: StepIntervals wants ten intervals.
constexpr uint64_t kJudgedSteps = 12;
constexpr double kMillisecondsInSecond = 1000;
/// Times that are rounded to milliseconds make the mean of few intervals uneven.
constexpr double kUnitTolerance = 50;

absl::Status Malformed(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "TRACE_MALFORMED", message);
}

}  // namespace

absl::Status TraceReader::Take(const v1::RenderRequest& request) {
  switch (request.request_case()) {
    case v1::RenderRequest::kSettings:
      return TakeSettings(request.settings());
    case v1::RenderRequest::kRecord:
      return TakeRecord(request.record());
    default:
      return Malformed("a request is neither settings nor record");
  }
}

absl::Status TraceReader::Finish() {
  if (!renderer_) {
    return Malformed("the trace is empty; send settings, a header, objects, then steps");
  }
  renderer_->forward().Finish();
  return absl::OkStatus();
}

absl::Status TraceReader::TakeSettings(const v1::RenderSettings& settings) {
  if (settings_) return Malformed("settings were sent twice; they come first, once");
  settings_.emplace();
  if (settings.sample_rate_hz() != 0) settings_->sample_rate_hz = settings.sample_rate_hz();
  settings_->tail_s = settings.tail_s();
  settings_->longest_s = settings.longest_s();
  settings_->tells_blows = settings.tell_blows();
  if (settings.has_gain()) settings_->gain = settings.gain();
  if (settings.has_full_scale_pa()) settings_->full_scale_pa = settings.full_scale_pa();
  if (settings.channel_count() != 0) settings_->channel_count = settings.channel_count();
  return absl::OkStatus();
}

absl::Status TraceReader::TakeRecord(const v1::ContactTraceRecord& record) {
  if (!settings_) return Malformed("a record came before the settings; they come first, once");
  if (record.has_header()) return TakeHeader(record.header());
  if (!renderer_) return Malformed("the first record is not a header");
  if (record.has_object()) return TakeObject(record.object());
  if (record.has_step()) return TakeStep(record.step());
  return Malformed("a record is neither header, object nor step");
}

absl::Status TraceReader::TakeHeader(const v1::ContactTraceHeader& header) {
  if (renderer_) return Malformed("the trace has two headers");
  if (header.format_version() != kFormatVersion) {
    return Malformed(absl::StrCat("the trace is of format version ", header.format_version(),
                                  "; this daemon reads ", kFormatVersion));
  }
  if (header.step_s() != 0) settings_->step_s = header.step_s();
  if (!IsStepLength(settings_->step_s)) {
    return Malformed(absl::StrCat("the header's step_s is ", header.step_s(),
                                  "; say the simulator's step, from 1e-6 to 1 s"));
  }
  settings_->space = ToSceneSpace(header.hearing(), header.listener());
  RETURN_IF_ERROR(
      heads_.Complete(settings_->space, settings_->sample_rate_hz, settings_->channel_count));
  settings_->reading = ToContactReading(header.frame(), header.pulse_shape());
  if (header.has_gain()) settings_->gain *= header.gain();
  if (header.has_clock()) {
    RETURN_IF_ERROR(TakeClock(header.clock()));
  }
  ASSIGN_OR_RETURN(renderer_, OfflineRenderer::Make(*settings_, bodies_, &database_.transfers()));
  return absl::OkStatus();
}

absl::Status TraceReader::TakeClock(const v1::ContactTraceClock& clock) {
  const auto wrong = [](absl::string_view field, double value, absl::string_view limits) {
    return Malformed(absl::StrCat("the header's clock.", field, " is ", ShortestDecimal(value),
                                  "; it must be ", limits, ", as the daemon answered"));
  };
  const auto first_frame = static_cast<double>(clock.first_frame());
  if (clock.first_frame() % OfflineRenderer::kBlockFrameCount != 0 ||
      clock.first_frame() > kMostFirstFrame) {
    return wrong("first_frame", first_frame, "a multiple of 128 up to 2^48");
  }
  if (!(std::abs(clock.first_time_s()) <= kLargestStepTimeS)) {
    return wrong("first_time_s", clock.first_time_s(), "at most 1e10 s before or after 0");
  }
  if (!(clock.scheduling_delay_s() >= 0 && clock.scheduling_delay_s() <= 10)) {
    return wrong("scheduling_delay_s", clock.scheduling_delay_s(), "0 to 10 s");
  }
  if (clock.stagger() >= kSectionCount) return wrong("stagger", clock.stagger(), "0 to 15");
  settings_->mapping = {.first_frame = clock.first_frame(),
                        .first_time_s = clock.first_time_s(),
                        .delay_s = clock.scheduling_delay_s()};
  settings_->stagger = clock.stagger();
  time_s_ = clock.first_time_s();
  return absl::OkStatus();
}

absl::Status TraceReader::TakeObject(const v1::ContactTraceObject& message) {
  ASSIGN_OR_RETURN(ObjectOfModel object, ToObject(message, database_.models()));
  return renderer_->forward().AddObject(message.handle(), std::move(object.model),
                                        object.properties);
}

absl::Status TraceReader::CheckTime(double time_s) const {
  const double first_s = settings_->mapping.first_time_s;
  const double last_s = first_s + OfflineRenderer::kMaxDurationS;
  const std::string time = ShortestDecimal(time_s);
  const uint64_t step = renderer_->intake().step_count();
  if (!(time_s >= first_s && time_s <= last_s)) {
    return Malformed(absl::StrCat(
        "step ", step, " is at ", time, " s; times must be ", ShortestDecimal(first_s), " to ",
        ShortestDecimal(last_s),
        " s: shift them all, or say in clock.first_time_s of the header where they begin"));
  }
  if (time_s >= time_s_) return absl::OkStatus();
  return Malformed(absl::StrCat("time goes back from ", ShortestDecimal(time_s_), " s to ", time,
                                " s at step ", step, "; write another trace for another run"));
}

absl::Status TraceReader::TakeStep(const v1::ContactStep& step) {
  RETURN_IF_ERROR(CheckTime(step.time_s()));
  time_s_ = step.time_s();
  RETURN_IF_ERROR(ReadStep(step, renderer_->intake()));
  return renderer_->intake().step_count() == kJudgedSteps ? CheckUnit(step) : absl::OkStatus();
}

/// Refuses times in milliseconds, which would make hours of silence. A trace of strikes alone may
/// have steps as far apart.
absl::Status TraceReader::CheckUnit(const v1::ContactStep& step) const {
  const IntakeFindings findings = renderer_->intake().findings();
  const bool simulates =
      step.has_poses() || findings.engine.blow_count + findings.engine.load_count > 0;
  const double steps = findings.regular_gap_s / settings_->step_s;
  if (!simulates || std::abs(steps - kMillisecondsInSecond) > kUnitTolerance) {
    return absl::OkStatus();
  }
  return Malformed(absl::StrCat(
      "the first ", kJudgedSteps, " steps are ", ShortestDecimal(findings.regular_gap_s),
      " s apart, 1000 times the header's step_s of ", ShortestDecimal(settings_->step_s),
      ": their times are probably in milliseconds; give seconds"));
}

}  // namespace carillon
