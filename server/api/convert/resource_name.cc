// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/resource_name.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
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

bool IsOfSceneId(unsigned char c) {
  return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '.' || c == '_' || c == '-';
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

absl::StatusOr<std::string> ParseSceneName(absl::string_view name) {
  absl::string_view id = name;
  if (absl::ConsumePrefix(&id, "scenes/") && !id.empty() && !absl::StrContains(id, '/')) {
    return std::string(id);
  }
  return NotAName("SCENE_NOT_FOUND", name, "scenes/{id}");
}

absl::Status ValidateSceneId(absl::string_view id) {
  constexpr size_t kLongest = 64;
  const bool fits = !id.empty() && id.size() <= kLongest && absl::ascii_islower(id.front());
  if (fits && std::ranges::all_of(id, IsOfSceneId)) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
      absl::StrCat("the id of a scene is 1 to ", kLongest,
                   " lower-case letters, digits, \".\", \"_\" and \"-\", of which the "
                   "first is a letter; this one is \"",
                   absl::CHexEscape(id.substr(0, kLongest)), "\" of ", id.size(), " bytes"));
}

absl::StatusOr<ObjectName> ParseObjectName(absl::string_view name) {
  const size_t separator = name.find("/objects/");
  if (separator == absl::string_view::npos) {
    return NotAName("OBJECT_NOT_FOUND", name, "scenes/{id}/objects/{handle}");
  }
  ObjectName object;
  ASSIGN_OR_RETURN(object.scene, ParseSceneName(name.substr(0, separator)));
  if (absl::SimpleAtoi(name.substr(separator + 9), &object.handle)) return object;
  return NotAName("OBJECT_NOT_FOUND", name, "scenes/{id}/objects/{handle}");
}

std::string ModelName(absl::string_view digest) { return absl::StrCat("modalModels/", digest); }

}  // namespace carillon
