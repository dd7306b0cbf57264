// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/scene_owners.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/resource_name.h"

namespace carillon {

void SceneOwners::Add(uint64_t scene, const Principal& owner, ClientPlace place,
                      const SceneWish& wish) {
  leases_.Begin(scene, owner.connection, wish.keep);
  const MutexLock lock(&mutex_);
  owners_[scene] = {
      .name = owner.name, .client = owner.client, .place = std::move(place), .wish = wish};
}

void SceneOwners::Remove(uint64_t scene) {
  leases_.End(scene);
  const MutexLock lock(&mutex_);
  owners_.erase(scene);
}

std::optional<uint64_t> SceneOwners::LongestAbandoned(const std::optional<std::string>& client) {
  return leases_.LongestAbandoned([&](uint64_t scene) {
    const MutexLock lock(&mutex_);
    const auto owner = owners_.find(scene);
    return !client || (owner != owners_.end() && owner->second.client == *client);
  });
}

std::vector<uint64_t> SceneOwners::ScenesOfItsClient(uint64_t scene) const {
  const MutexLock lock(&mutex_);
  std::vector<uint64_t> scenes;
  const auto found = owners_.find(scene);
  if (found == owners_.end()) return scenes;
  for (const auto& [other, owner] : owners_) {
    if (owner.client == found->second.client) scenes.push_back(other);
  }
  return scenes;
}

bool SceneOwners::Owns(const Principal& caller, uint64_t scene) const {
  if (caller.has(Role::kAdminister)) return true;
  const MutexLock lock(&mutex_);
  const auto owner = owners_.find(scene);
  return owner == owners_.end() || owner->second.name == caller.name;
}

absl::StatusOr<uint64_t> SceneOwners::Parse(const grpc::CallbackServerContext& context,
                                            const Principal& caller, absl::string_view name,
                                            SceneCall call) const {
  ASSIGN_OR_RETURN(const std::string id, ParseSceneName(name));
  ASSIGN_OR_RETURN(const uint64_t scene, scenes_.FindId(id));
  RETURN_IF_ERROR(Check(context, caller, scene, call));
  return scene;
}

absl::Status SceneOwners::CheckMadeBy(const grpc::CallbackServerContext& context,
                                      const Principal& caller, uint64_t scene,
                                      const SceneWish& wish) const {
  const std::string name = scenes_.NameOf(scene);
  const std::optional<Made> made = FindMade(scene);
  if (!made) {
    return Refusal(absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
                   absl::StrCat(name, " ends just now: make it again"));
  }
  if (made->owner != caller.name) {
    return access_.Refuse(context, caller.function,
                          Refusal(absl::StatusCode::kAlreadyExists, "SCENE_ID_TAKEN",
                                  absl::StrCat(name, " belongs to another caller than ",
                                               caller.name, ": choose another id")));
  }
  if (made->wish != wish) {
    return Refusal(absl::StatusCode::kAlreadyExists, "SCENE_DIFFERS",
                   absl::StrCat(name,
                                " was made with another hearing, listener, keep or gain: give the "
                                "same ones, or delete it first"));
  }
  leases_.Use(scene, caller.connection);
  return absl::OkStatus();
}

std::optional<SceneOwners::Made> SceneOwners::FindMade(uint64_t scene) const {
  const MutexLock lock(&mutex_);
  const auto owner = owners_.find(scene);
  if (owner == owners_.end()) return std::nullopt;
  return Made{.owner = owner->second.name, .wish = owner->second.wish};
}

absl::Status SceneOwners::Check(const grpc::CallbackServerContext& context, const Principal& caller,
                                uint64_t scene, SceneCall call) const {
  if (Owns(caller, scene)) {
    if (call == SceneCall::kUses) leases_.Use(scene, caller.connection);
    return absl::OkStatus();
  }
  return access_.Refuse(
      context, caller.function,
      Refusal(absl::StatusCode::kPermissionDenied, "SCENE_OF_ANOTHER",
              absl::StrCat(scenes_.NameOf(scene), " belongs to another caller than ", caller.name,
                           ": name a scene of your own, or make one (CreateScene)")));
}

}  // namespace carillon
