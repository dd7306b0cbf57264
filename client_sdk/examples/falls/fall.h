// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "client_sdk/examples/falls/fall_scene.h"

namespace carillon::falls {

/// Advances a simulation by one step. Returns the contacts and poses, in which body i of the scene
/// is the object i + 1.
using Simulation = std::function<v1::ContactStep()>;

/// Simulates the scene in an engine with steps of `step_s` seconds. Errors: InvalidArgument, if
/// MuJoCo refuses a body.
Simulation FallInBullet(const FallScene& scene, double step_s);
Simulation FallInOde(const FallScene& scene, double step_s);
absl::StatusOr<Simulation> FallInMujoco(const FallScene& scene, double step_s);

}  // namespace carillon::falls
