// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_stream.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr double kNetworkJitterS = 0.005;
constexpr double kLongestDelayS = 10;
/// Greatest number of events that wait for the mixer, which takes them at each block.
constexpr size_t kQueueCapacity = 16384;

absl::Status InvalidStream(absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_STREAM", message);
}

absl::StatusOr<double> SchedulingDelay(const ContactStreamSettings& settings, const Mixer& mixer) {
  if (!IsStepLength(settings.step_s)) {
    return InvalidStream(absl::StrCat("step_s is ", settings.step_s,
                                      "; say the simulator's step, from 1e-6 to 1 s"));
  }
  const double block_s =
      static_cast<double>(mixer.settings().block_frame_count) / mixer.settings().sample_rate_hz;
  if (settings.at_once && settings.scheduling_delay_s.value_or(0) != 0) {
    return InvalidStream("at_once and a scheduling_delay_s above zero exclude each other");
  }
  if (settings.at_once) return 0;
  const double delay_s =
      settings.scheduling_delay_s.value_or(settings.step_s + block_s + kNetworkJitterS);
  if (!(delay_s >= 0 && delay_s <= kLongestDelayS)) {
    return InvalidStream(
        absl::StrCat("scheduling_delay_s is ", delay_s, "; it must be 0 to ", kLongestDelayS));
  }
  return delay_s;
}

}  // namespace

absl::StatusOr<std::unique_ptr<ContactStream>> ContactStream::Make(
    std::shared_ptr<Scene> scene, Mixer& mixer, const ContactStreamSettings& settings) {
  ASSIGN_OR_RETURN(const double delay_s, SchedulingDelay(settings, mixer));
  ASSIGN_OR_RETURN(std::unique_ptr<EventStream> events,
                   mixer.OpenStream(kQueueCapacity,
                                    settings.at_once ? StreamKind::kAtOnce : StreamKind::kTimely));
  const IntakeSettings intake{.sample_rate_hz = mixer.settings().sample_rate_hz,
                              .step_s = settings.step_s,
                              .delay_s = delay_s,
                              .at_once = settings.at_once,
                              .reading = settings.reading,
                              .rejections = settings.rejections};
  return std::unique_ptr<ContactStream>(
      new ContactStream(std::move(scene), mixer, intake, std::move(events)));
}

ContactStream::ContactStream(std::shared_ptr<Scene> scene, const Mixer& mixer,
                             const IntakeSettings& settings, std::unique_ptr<EventStream> events)
    : scene_(std::move(scene)),
      target_(mixer, std::move(events)),
      intake_(*scene_, target_, settings) {}

ContactCounts ContactStream::counts() const {
  return {.step_count = intake_.step_count(),
          .accepted_count = target_.events().accepted_count(),
          .late_count = target_.events().late_count(),
          .dropped_count = target_.events().dropped_count(),
          .rejected_count = intake_.rejected_count(),
          .remap_count = intake_.remap_count()};
}

bool ContactStream::settled() const {
  const ContactCounts now = counts();
  return now.accepted_count + now.late_count + now.dropped_count >= intake_.impulse_count();
}

}  // namespace carillon
