// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/perform_conversion.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

constexpr uint32_t kMostAmbisonicOrder = 3;
constexpr double kReferenceDistanceM = 0.1;

absl::StatusOr<MicrophoneKind> KindOf(v1::MicrophoneKind kind) {
  switch (kind) {
    case v1::MICROPHONE_KIND_UNSPECIFIED:
    case v1::MICROPHONE_KIND_OMNI:
      return MicrophoneKind::kOmni;
    case v1::MICROPHONE_KIND_STEREO:
      return MicrophoneKind::kStereo;
    case v1::MICROPHONE_KIND_EARS:
      return MicrophoneKind::kEars;
    case v1::MICROPHONE_KIND_AMBISONIC:
      return MicrophoneKind::kAmbisonic;
    default:
      return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                     absl::StrCat("this daemon does not know the kind ", static_cast<int>(kind),
                                  " of a microphone: update it"));
  }
}

absl::StatusOr<Microphone> FromProto(const v1::Microphone& message) {
  Microphone microphone;
  ASSIGN_OR_RETURN(microphone.kind, KindOf(message.kind()));
  microphone.ambisonic_order = std::max(message.ambisonic_order(), 1U);
  if (microphone.ambisonic_order > kMostAmbisonicOrder) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("ambisonic_order is ", message.ambisonic_order(),
                                "; it must be 1 to ", kMostAmbisonicOrder));
  }
  if (message.has_pose()) microphone.pose = carillon::FromProto(message.pose());
  RETURN_IF_ERROR(Validate(microphone.pose));
  if (message.object() != 0) microphone.object = message.object();
  return microphone;
}

}  // namespace

absl::StatusOr<EnvironmentSettings> ToEnvironmentSettings(const v1::PerformSettings& settings,
                                                          HeadStore& heads) {
  EnvironmentSettings to;
  if (settings.sample_rate_hz() != 0) to.sample_rate_hz = settings.sample_rate_hz();
  if (settings.step_s() != 0) to.step_s = settings.step_s();
  to.latency_s = settings.latency_s();
  if (settings.full_scale_pa() != 0) to.full_scale_pa = settings.full_scale_pa();
  to.hearing = {.distance_gain = true, .reference_distance_m = kReferenceDistanceM};
  if (settings.has_hearing()) {
    to.hearing = ToSceneSpace(settings.hearing(), {}).hearing;
    if (settings.hearing().reference_distance_m() == 0) {
      to.hearing.reference_distance_m = kReferenceDistanceM;
    }
  }
  to.reading = ToContactReading(settings.frame(), settings.pulse_shape());
  to.tells_impacts = settings.tell_impacts();
  for (const v1::Microphone& message : settings.microphones()) {
    ASSIGN_OR_RETURN(const Microphone microphone, FromProto(message));
    if (microphone.kind == MicrophoneKind::kEars && to.head == nullptr) {
      ASSIGN_OR_RETURN(to.head, heads.Get(to.sample_rate_hz));
    }
    to.microphones.push_back(microphone);
  }
  if (to.microphones.empty()) to.microphones.emplace_back();
  return to;
}

void AddImpact(uint32_t environment, const BlowRecord& impact, v1::PerformedImpacts& impacts) {
  impacts.add_environment(environment);
  impacts.add_object(impact.handle);
  impacts.add_other(impact.by.value_or(0));
  impacts.add_time_s(impact.time_s);
  for (const double coordinate : impact.point_m) {
    impacts.add_point_m(static_cast<float>(coordinate));
  }
  for (const float component : impact.impulse_newton_seconds) {
    impacts.add_impulse_newton_seconds(component);
  }
  impacts.add_duration_s(static_cast<float>(impact.duration_s));
}

}  // namespace carillon
