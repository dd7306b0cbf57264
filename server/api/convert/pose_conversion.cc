// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/pose_conversion.h"

namespace carillon {

Quaternion FromProto(const v1::Quaternion& proto) {
  return {.w = proto.w(), .x = proto.x(), .y = proto.y(), .z = proto.z()};
}

Pose FromProto(const v1::Pose& proto) {
  const v1::Vec3& position = proto.position_m();
  Pose pose{.position_m = {position.x(), position.y(), position.z()}};
  if (proto.has_orientation()) pose.orientation = FromProto(proto.orientation());
  return pose;
}

v1::Pose ToProto(const Pose& pose) {
  v1::Pose proto;
  v1::Vec3& position = *proto.mutable_position_m();
  position.set_x(pose.position_m[0]);
  position.set_y(pose.position_m[1]);
  position.set_z(pose.position_m[2]);
  v1::Quaternion& orientation = *proto.mutable_orientation();
  orientation.set_w(pose.orientation.w);
  orientation.set_x(pose.orientation.x);
  orientation.set_y(pose.orientation.y);
  orientation.set_z(pose.orientation.z);
  return proto;
}

v1::Hearing ToProto(const HearingSettings& hearing) {
  v1::Hearing proto;
  proto.set_distance_gain(hearing.distance_gain);
  proto.set_propagation_delay(hearing.propagation_delay);
  proto.set_panning(hearing.panning);
  proto.set_binaural(hearing.binaural);
  proto.set_directivity(hearing.directivity);
  proto.set_near_field(hearing.near_field);
  proto.set_reference_distance_m(hearing.reference_distance_m);
  proto.set_sound_speed_m_per_s(hearing.sound_speed_m_per_s);
  return proto;
}

SceneSpace ToSceneSpace(const v1::Hearing& hearing, const v1::Pose& listener) {
  SceneSpace space{.hearing = {.distance_gain = hearing.distance_gain(),
                               .propagation_delay = hearing.propagation_delay(),
                               .panning = hearing.panning(),
                               .binaural = hearing.binaural(),
                               .directivity = hearing.directivity(),
                               .near_field = hearing.near_field()},
                   .listener = FromProto(listener)};
  if (hearing.reference_distance_m() != 0) {
    space.hearing.reference_distance_m = hearing.reference_distance_m();
  }
  if (hearing.sound_speed_m_per_s() != 0) {
    space.hearing.sound_speed_m_per_s = hearing.sound_speed_m_per_s();
  }
  return space;
}

}  // namespace carillon
