// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Returns the digest of "modalModels/{digest}". Errors: NotFound (MODAL_MODEL_NOT_FOUND).
absl::StatusOr<std::string> ParseModelName(absl::string_view name);

/// Returns the digest of "jobs/{digest}". Errors: NotFound (JOB_NOT_FOUND).
absl::StatusOr<std::string> ParseJobName(absl::string_view name);

/// Returns the id of "scenes/{id}". Errors: NotFound (SCENE_NOT_FOUND).
absl::StatusOr<uint64_t> ParseSceneName(absl::string_view name);

struct ObjectName {
  uint64_t scene = 0;
  uint32_t handle = 0;
};

/// Returns the parts of "scenes/{id}/objects/{handle}". Errors: NotFound (SCENE_NOT_FOUND,
/// OBJECT_NOT_FOUND).
absl::StatusOr<ObjectName> ParseObjectName(absl::string_view name);

std::string ModelName(absl::string_view digest);
std::string SceneName(uint64_t scene);
std::string ObjectNameString(uint64_t scene, uint32_t handle);

}  // namespace carillon
