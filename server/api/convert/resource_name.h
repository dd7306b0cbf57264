// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Returns the digest of "modalModels/{digest}". Errors: NotFound (MODAL_MODEL_NOT_FOUND).
absl::StatusOr<std::string> ParseModelName(absl::string_view name);

/// Returns the digest of "jobs/{digest}". Errors: NotFound (JOB_NOT_FOUND).
absl::StatusOr<std::string> ParseJobName(absl::string_view name);

/// Returns the id of "scenes/{id}". Errors: NotFound (SCENE_NOT_FOUND).
absl::StatusOr<std::string> ParseSceneName(absl::string_view name);

/// Checks an id that a client gives a scene. It has 1 to 64 lower-case letters, digits, ".", "_"
/// and "-", and begins with a letter. Errors: InvalidArgument (INVALID_SETTINGS).
absl::Status ValidateSceneId(absl::string_view id);

struct ObjectName {
  std::string scene{};  ///< the id of the scene
  uint32_t handle = 0;
};

/// Returns the parts of "scenes/{id}/objects/{handle}". Errors: NotFound (SCENE_NOT_FOUND,
/// OBJECT_NOT_FOUND).
absl::StatusOr<ObjectName> ParseObjectName(absl::string_view name);

std::string ModelName(absl::string_view digest);

}  // namespace carillon
