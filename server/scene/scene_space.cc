// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_space.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

absl::Status InRange(absl::string_view what, double value, double least, double most) {
  if (value >= least && value <= most) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat(what, " is ", value, "; it must be ", least, " to ", most));
}

Place PlaceOf(const Pose& pose) {
  const Quaternion orientation = Normalized(pose.orientation);
  return {.position_m = pose.position_m,
          .right = Rotated({1, 0, 0}, orientation),
          .orientation = orientation};
}

}  // namespace

absl::Status Validate(const SceneSpace& space) {
  if (space.hearing.near_field && !space.hearing.directivity) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "near_field works only with directivity, whose gains it changes: set both");
  }
  absl::Status status =
      InRange("reference_distance_m", space.hearing.reference_distance_m, 0.01, 1000);
  if (!status.ok()) return status;
  status = InRange("sound_speed_m_per_s", space.hearing.sound_speed_m_per_s, 10, 10000);
  return status.ok() ? Validate(space.listener) : status;
}

std::shared_ptr<Voice> MakeVoice(const SceneSpace& space, const std::optional<Pose>& pose,
                                 const MixerSettings& mixer) {
  if (!space.hearing.any()) return nullptr;
  return std::make_shared<Voice>(Voice::Settings{.hearing = space.hearing,
                                                 .sample_rate_hz = mixer.sample_rate_hz,
                                                 .block_frame_count = mixer.block_frame_count,
                                                 .channel_count = mixer.channel_count,
                                                 .head = space.head},
                                 PlaceOf(pose.value_or(Pose())), PlaceOf(space.listener));
}

Motion MotionTo(const Pose& pose, double glide_frames) {
  const Place place = PlaceOf(pose);
  Motion motion{.glide_frames = static_cast<float>(glide_frames)};
  const auto narrow = [](double x) { return static_cast<float>(x); };
  std::ranges::transform(place.position_m, motion.position_m.begin(), narrow);
  std::ranges::transform(place.right, motion.right.begin(), narrow);
  const Quaternion& q = place.orientation;
  const double sign = q.w < 0 ? -1 : 1;
  std::ranges::transform(std::array{sign * q.x, sign * q.y, sign * q.z}, motion.orientation.begin(),
                         narrow);
  return motion;
}

double PoseTimes::GlideS(std::optional<uint32_t> handle, double time_s) {
  const auto [reported, first] = reported_s_.try_emplace(handle, time_s);
  if (first) return 0;
  const double since_s = time_s - reported->second;
  reported->second = time_s;
  return std::min(since_s, step_s_);
}

}  // namespace carillon
