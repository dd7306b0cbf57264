// SPDX-License-Identifier: Apache-2.0
#include "server/api/scene_owners.h"

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/resource_name.h"

namespace carillon {

void SceneOwners::Add(uint64_t scene, const std::string& owner) {
  const MutexLock lock(&mutex_);
  owners_[scene] = owner;
}

void SceneOwners::Remove(uint64_t scene) {
  const MutexLock lock(&mutex_);
  owners_.erase(scene);
}

bool SceneOwners::Owns(const Principal& caller, uint64_t scene) const {
  if (caller.has(Role::kAdminister)) return true;
  const MutexLock lock(&mutex_);
  const auto owner = owners_.find(scene);
  return owner == owners_.end() || owner->second == caller.name;
}

absl::StatusOr<uint64_t> SceneOwners::Parse(const grpc::CallbackServerContext& context,
                                            const Principal& caller, absl::string_view name) const {
  ASSIGN_OR_RETURN(const uint64_t scene, ParseSceneName(name));
  RETURN_IF_ERROR(Check(context, caller, scene));
  return scene;
}

absl::Status SceneOwners::Check(const grpc::CallbackServerContext& context, const Principal& caller,
                                uint64_t scene) const {
  if (Owns(caller, scene)) return absl::OkStatus();
  return access_.Refuse(
      context, Refusal(absl::StatusCode::kPermissionDenied, "SCENE_OF_ANOTHER",
                       absl::StrCat(SceneName(scene), " belongs to another caller than ",
                                    caller.name, ": make a scene with SceneService.CreateScene")));
}

}  // namespace carillon
