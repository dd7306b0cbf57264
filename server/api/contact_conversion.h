// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/v1/contact.pb.h"
#include "server/scene/contact_stream.h"

namespace carillon {

/// Takes what a step holds.
struct ContactSink {
  absl::FunctionRef<void(uint32_t handle, const Pose&)> move;
  absl::FunctionRef<void(const Pose&)> move_listener;
  absl::FunctionRef<void(const ObjectImpulse&)> strike;
  absl::FunctionRef<void(const ObjectForce&)> hold;
  absl::FunctionRef<void(const ObjectTouch&)> touch;
  /// How many contacts could not be read, and why (LOCATION_MISSING, COLUMNS_MISMATCHED).
  absl::FunctionRef<void(uint64_t, absl::Status)> reject;
};

/// Gives `sink` all that a step holds: poses, impulses, then forces, then touches; rows before
/// columns.
void ReadStep(const v1::ContactStep& step, const ContactSink& sink);

}  // namespace carillon
