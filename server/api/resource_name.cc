// SPDX-License-Identifier: Apache-2.0
#include "server/api/resource_name.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status NotAName(absl::string_view reason, absl::string_view name, absl::string_view form) {
  return Refusal(absl::StatusCode::kNotFound, reason,
                 absl::StrCat("\"", name, "\" names nothing; a name has the form ", form));
}

}  // namespace

absl::StatusOr<std::string> ParseModelName(absl::string_view name) {
  absl::string_view digest = name;
  if (absl::ConsumePrefix(&digest, "modalModels/")) return std::string(digest);
  return NotAName("MODAL_MODEL_NOT_FOUND", name, "modalModels/{digest}");
}

absl::StatusOr<std::string> ParseJobName(absl::string_view name) {
  absl::string_view digest = name;
  if (absl::ConsumePrefix(&digest, "jobs/")) return std::string(digest);
  return NotAName("JOB_NOT_FOUND", name, "jobs/{digest}");
}

absl::StatusOr<uint64_t> ParseSceneName(absl::string_view name) {
  absl::string_view id = name;
  uint64_t scene = 0;
  if (absl::ConsumePrefix(&id, "scenes/") && absl::SimpleAtoi(id, &scene)) return scene;
  return NotAName("SCENE_NOT_FOUND", name, "scenes/{id}");
}

absl::StatusOr<ObjectName> ParseObjectName(absl::string_view name) {
  const size_t separator = name.find("/objects/");
  if (separator == absl::string_view::npos) {
    return NotAName("OBJECT_NOT_FOUND", name, "scenes/{id}/objects/{handle}");
  }
  ASSIGN_OR_RETURN(const uint64_t scene, ParseSceneName(name.substr(0, separator)));
  ObjectName object{.scene = scene};
  if (absl::SimpleAtoi(name.substr(separator + 9), &object.handle)) return object;
  return NotAName("OBJECT_NOT_FOUND", name, "scenes/{id}/objects/{handle}");
}

std::string ModelName(absl::string_view digest) { return absl::StrCat("modalModels/", digest); }

std::string SceneName(uint64_t scene) { return absl::StrCat("scenes/", scene); }

std::string ObjectNameString(uint64_t scene, uint32_t handle) {
  return absl::StrCat("scenes/", scene, "/objects/", handle);
}

}  // namespace carillon
