// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {

absl::StatusOr<const SoundingObject*> Scene::Find(uint32_t handle) const {
  RETURN_IF_ERROR(CheckOpenLocked());
  const auto found = objects_.find(handle);
  if (found != objects_.end()) return &found->second;
  return ObjectNotFound(handle);
}

absl::StatusOr<const SoundingObject*> Scene::FindSame(uint32_t handle, uint64_t serial) const {
  ASSIGN_OR_RETURN(const SoundingObject* object, Find(handle));
  if (object->serial != serial) return ObjectNotFound(handle);
  return object;
}

absl::StatusOr<const SoundingObject*> Scene::Move(uint32_t handle, const Pose& pose) {
  RETURN_IF_ERROR(Validate(pose));
  ASSIGN_OR_RETURN(const SoundingObject* object, Find(handle));
  objects_[handle].properties.pose = pose;
  return object;
}

absl::StatusOr<const std::map<uint32_t, SoundingObject>*> Scene::MoveListener(const Pose& pose) {
  RETURN_IF_ERROR(Validate(pose));
  RETURN_IF_ERROR(CheckOpenLocked());
  space_.listener = pose;
  return &objects_;
}

SceneSpace Scene::space() const {
  const MutexLock lock(&mutex_);
  return space_;
}

absl::StatusOr<SoundingObject> Scene::Copy(uint32_t handle) const {
  const MutexLock lock(&mutex_);
  ASSIGN_OR_RETURN(const SoundingObject* object, Find(handle));
  return *object;
}

std::map<uint32_t, SoundingObject> Scene::CopyAll() const {
  const MutexLock lock(&mutex_);
  return objects_;
}

size_t Scene::object_count() const {
  const MutexLock lock(&mutex_);
  return objects_.size();
}

absl::Status Scene::CheckFree(uint32_t handle) const {
  const MutexLock lock(&mutex_);
  return objects_.contains(handle) ? ObjectExists(handle) : absl::OkStatus();
}

std::set<uint32_t> Scene::handles() const {
  const MutexLock lock(&mutex_);
  std::set<uint32_t> handles;
  for (const auto& [handle, object] : objects_) handles.insert(handles.end(), handle);
  return handles;
}

absl::Status Scene::Insert(uint32_t handle, SoundingObject object) {
  const MutexLock lock(&mutex_);
  RETURN_IF_ERROR(CheckOpenLocked());
  object.serial = ++last_serial_;
  if (!objects_.emplace(handle, std::move(object)).second) return ObjectExists(handle);
  return absl::OkStatus();
}

absl::StatusOr<SoundingObject> Scene::Replace(uint32_t handle, SoundingObject object) {
  const MutexLock lock(&mutex_);
  ASSIGN_OR_RETURN(const SoundingObject* replaced, Find(handle));
  object.serial = replaced->serial;
  object.properties.pose = replaced->properties.pose;
  return std::exchange(objects_[handle], std::move(object));
}

absl::StatusOr<SoundingObject> Scene::Remove(uint32_t handle) {
  const MutexLock lock(&mutex_);
  RETURN_IF_ERROR(Find(handle).status());
  return std::move(objects_.extract(handle).mapped());
}

std::map<uint32_t, SoundingObject> Scene::Close() {
  const MutexLock lock(&mutex_);
  closed_ = true;
  return std::exchange(objects_, {});
}

absl::Status Scene::CheckOpen() const {
  const MutexLock lock(&mutex_);
  return CheckOpenLocked();
}

absl::Status Scene::CheckOpenLocked() const {
  if (!closed_) return absl::OkStatus();
  return Refusal(absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
                 absl::StrCat(name_, " has been deleted; make another"));
}

absl::Status Scene::ObjectNotFound(uint32_t handle) const {
  return Refusal(absl::StatusCode::kNotFound, "OBJECT_NOT_FOUND",
                 absl::StrCat(name_, " has no object ", handle,
                              ", which is unknown or removed; add it before its first contact or "
                              "pose, and send nothing for it after its removal"));
}

absl::Status Scene::ObjectExists(uint32_t handle) const {
  return Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                 absl::StrCat(name_, " has an object ", handle,
                              " already; choose another handle, "
                              "or, if your program added it earlier, go on with it"));
}

}  // namespace carillon
