// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/contact.pb.h"
#include "carillon/v1/hearing.pb.h"
#include "server/base/pose.h"
#include "server/scene/scene_space.h"

namespace carillon {

/// Converts without a check. Validate checks whether the numbers are a rotation.
Quaternion FromProto(const v1::Quaternion& proto);
Pose FromProto(const v1::Pose& proto);

v1::Pose ToProto(const Pose& pose);
v1::Hearing ToProto(const HearingSettings& hearing);

/// Converts without a check. Zeros are replaced by the contract's defaults.
SceneSpace ToSceneSpace(const v1::Hearing& hearing, const v1::Pose& listener);

}  // namespace carillon
