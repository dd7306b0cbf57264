// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

absl::Status ObjectExists(uint64_t scene, uint32_t handle) {
  return Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                 absl::StrCat("scenes/", scene, " has an object ", handle,
                              " already; choose another handle, or 0 to have one chosen"));
}

}  // namespace

absl::Status Scene::Use(uint32_t handle,
                        absl::FunctionRef<absl::Status(const SoundingObject&)> use) const {
  const MutexLock lock(&mutex_);
  const auto found = Locate(handle);
  return found.ok() ? use((*found)->second) : found.status();
}

absl::Status Scene::Use(
    uint32_t first, uint32_t second,
    absl::FunctionRef<absl::Status(const SoundingObject&, const SoundingObject&)> use) const {
  const MutexLock lock(&mutex_);
  const auto found = Locate(first);
  if (!found.ok()) return found.status();
  const auto other = Locate(second);
  return other.ok() ? use((*found)->second, (*other)->second) : other.status();
}

SceneSpace Scene::space() const {
  const MutexLock lock(&mutex_);
  return space_;
}

absl::Status Scene::Move(uint32_t handle, const Pose& pose,
                         absl::FunctionRef<void(const SoundingObject&)> use) {
  if (absl::Status status = Validate(pose); !status.ok()) return status;
  const MutexLock lock(&mutex_);
  if (const auto found = Locate(handle); !found.ok()) return found.status();
  SoundingObject& object = objects_[handle];
  object.properties.pose = pose;
  use(object);
  return absl::OkStatus();
}

absl::Status Scene::MoveListener(const Pose& pose,
                                 absl::FunctionRef<void(const SoundingObject&)> use) {
  if (absl::Status status = Validate(pose); !status.ok()) return status;
  const MutexLock lock(&mutex_);
  if (closed_) return SceneNotFound();
  space_.listener = pose;
  for (const auto& [handle, object] : objects_) {
    if (object.voice != nullptr) use(object);
  }
  return absl::OkStatus();
}

absl::StatusOr<SoundingObject> Scene::Find(uint32_t handle) const {
  const MutexLock lock(&mutex_);
  const auto found = Locate(handle);
  if (!found.ok()) return found.status();
  return (*found)->second;
}

absl::StatusOr<uint32_t> Scene::ChooseHandle(uint32_t handle) const {
  const MutexLock lock(&mutex_);
  if (handle != 0) {
    if (objects_.contains(handle)) return ObjectExists(id_, handle);
    return handle;
  }
  uint32_t free = 1;
  for (const auto& [taken, object] : objects_) {
    if (taken != free) break;
    ++free;
  }
  return free;
}

absl::Status Scene::Insert(uint32_t handle, SoundingObject object) {
  const MutexLock lock(&mutex_);
  if (closed_) return SceneNotFound();
  if (!objects_.emplace(handle, std::move(object)).second) return ObjectExists(id_, handle);
  return absl::OkStatus();
}

absl::StatusOr<SoundingObject> Scene::Replace(uint32_t handle, SoundingObject object) {
  const MutexLock lock(&mutex_);
  if (const auto found = Locate(handle); !found.ok()) return found.status();
  return std::exchange(objects_[handle], std::move(object));
}

absl::StatusOr<SoundingObject> Scene::Remove(uint32_t handle) {
  const MutexLock lock(&mutex_);
  const auto found = Locate(handle);
  if (!found.ok()) return found.status();
  return std::move(objects_.extract(*found).mapped());
}

std::map<uint32_t, SoundingObject> Scene::Close() {
  const MutexLock lock(&mutex_);
  closed_ = true;
  return std::exchange(objects_, {});
}

absl::StatusOr<std::map<uint32_t, SoundingObject>::const_iterator> Scene::Locate(
    uint32_t handle) const {
  if (closed_) return SceneNotFound();
  const auto found = objects_.find(handle);
  if (found != objects_.end()) return found;
  return Refusal(absl::StatusCode::kNotFound, "OBJECT_NOT_FOUND",
                 absl::StrCat("scenes/", id_, " has no object ", handle,
                              "; add it first with SceneService.AddObject"));
}

absl::Status Scene::SceneNotFound() const {
  return Refusal(absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
                 absl::StrCat("scenes/", id_, " has been deleted; make another"));
}

}  // namespace carillon
