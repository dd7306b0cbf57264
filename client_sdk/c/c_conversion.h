// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "carillon/v1/hearing.pb.h"
#include "client_sdk/c/carillon.h"

namespace carillon::c {

/// Makes an OBJ file of three coordinates a vertex and three indices a triangle, with the same
/// bytes as the clients of other languages. Errors: InvalidArgument (MESH_INDEX_OUT_OF_RANGE).
absl::StatusOr<std::string> MakeObj(std::span<const double> vertices_m,
                                    std::span<const uint32_t> triangles);

v1::Pose ToPose(const carillon_pose& from);

v1::Hearing ToHearing(const carillon_hearing& from);

/// Errors: InvalidArgument (INVALID_SETTINGS: no such frame).
absl::StatusOr<v1::Frame> ToFrame(carillon_frame frame);

/// Fills in the object of a scene or of a trace.
template <class Message>
void Fill(const carillon_object& object, Message& message) {
  message.set_modal_model(object.model);
  message.mutable_material()->set_preset(object.material);
  if (object.size != 0) message.set_size(object.size);
  if (object.gain != 0) message.set_gain(object.gain);
  message.set_handle(object.handle);
}

/// Fills in the hearing and the listener of a scene or of a trace. Null leaves both absent.
template <class Message>
void Fill(const carillon_hearing* hearing, Message& message) {
  if (hearing == nullptr) return;
  *message.mutable_hearing() = ToHearing(*hearing);
  *message.mutable_listener() = ToPose(hearing->listener);
}

/// Errors: InvalidArgument (INVALID_SETTINGS: a null array of elements, or an unknown kind).
absl::StatusOr<v1::ContactStep> ToStep(const carillon_step& step);

/// Checks the length of a simulator's steps, seconds. Errors: InvalidArgument (INVALID_STREAM).
absl::Status CheckStep(double step_s);

}  // namespace carillon::c
