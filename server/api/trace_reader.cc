// SPDX-License-Identifier: Apache-2.0
#include "server/api/trace_reader.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/error_reason.h"
#include "server/api/contact_conversion.h"
#include "server/api/object_conversion.h"
#include "server/api/resource_name.h"

namespace carillon {
namespace {

constexpr uint32_t kFormatVersion = 1;

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

absl::StatusOr<std::unique_ptr<OfflineRenderer>> TraceReader::Finish() {
  if (!renderer_ || !has_header_) {
    return Malformed("the trace is empty; send settings, a header, objects, then steps");
  }
  return std::move(renderer_);
}

absl::Status TraceReader::TakeSettings(const v1::RenderSettings& settings) {
  if (renderer_) return Malformed("settings were sent twice; they come first, once");
  if (settings.sample_rate_hz() != 0) sample_rate_hz_ = settings.sample_rate_hz();
  absl::StatusOr<std::unique_ptr<OfflineRenderer>> renderer = OfflineRenderer::Make(
      {.sample_rate_hz = sample_rate_hz_, .tail_s = settings.tail_s()}, bodies_);
  if (!renderer.ok()) return renderer.status();
  renderer_ = *std::move(renderer);
  return absl::OkStatus();
}

absl::Status TraceReader::TakeRecord(const v1::ContactTraceRecord& record) {
  if (!renderer_) return Malformed("a record came before the settings; they come first, once");
  if (record.has_header()) return TakeHeader(record.header());
  if (!has_header_) return Malformed("the first record is not a header");
  if (record.has_object()) return TakeObject(record.object());
  if (record.has_step()) return TakeStep(record.step());
  return Malformed("a record is neither header, object nor step");
}

absl::Status TraceReader::TakeHeader(const v1::ContactTraceHeader& header) {
  if (has_header_) return Malformed("the trace has two headers");
  if (header.format_version() != kFormatVersion) {
    return Malformed(absl::StrCat("the trace is of format version ", header.format_version(),
                                  "; this daemon reads ", kFormatVersion));
  }
  if (header.step_s() > 0 && header.step_s() <= 1) renderer_->SetSimulatorStep(header.step_s());
  has_header_ = true;
  return absl::OkStatus();
}

absl::Status TraceReader::TakeObject(const v1::ContactTraceObject& object) {
  const absl::StatusOr<std::string> digest = ParseModelName(object.modal_model());
  if (!digest.ok()) return digest.status();
  const absl::StatusOr<ObjectProperties> properties =
      ToObjectProperties(object.material(), object.size(),
                         object.has_gain() ? std::optional(object.gain()) : std::nullopt);
  if (!properties.ok()) return properties.status();
  absl::StatusOr<std::shared_ptr<const ModalModel>> model = models_.FindToSound(*digest);
  if (!model.ok()) return model.status();
  return renderer_->AddObject(object.handle(), *std::move(model), *properties);
}

absl::Status TraceReader::TakeStep(const v1::ContactStep& step) {
  if (!(step.time_s() >= time_s_ && step.time_s() <= OfflineRenderer::kMaxTimeS)) {
    return Malformed(absl::StrCat("a step at ", step.time_s(), " s follows one at ", time_s_,
                                  " s; times start at zero or later, do not go back, and end by ",
                                  OfflineRenderer::kMaxTimeS, " s"));
  }
  time_s_ = step.time_s();
  impulse_count_ += static_cast<uint64_t>(step.impulses_size() + step.columns().object_size() +
                                          step.sustained_size() + step.contacts_size());
  if (impulse_count_ > kMaxImpulseCount) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "TRACE_TOO_LARGE",
        absl::StrCat("the trace has over ", kMaxImpulseCount, " impulses; render it in pieces"));
  }
  renderer_->BeginStep(time_s_);
  ReadStep(step,
           {.strike = [this](const ObjectImpulse& impulse) { renderer_->Strike(impulse); },
            .hold = [this](const ObjectForce& force) { renderer_->Hold(force); },
            .touch = [this](const ObjectTouch& touch) { renderer_->Touch(touch); },
            .reject = [this](uint64_t count, const absl::Status&) { renderer_->Reject(count); }});
  renderer_->EndStep();
  return absl::OkStatus();
}

}  // namespace carillon
