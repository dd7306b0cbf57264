// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/scene/scene_space.h"
#include "server/scene/sounding_object.h"

namespace carillon {

/// The objects that one client makes sound together. Safe from every thread; a contact uses
/// it under its lock, and what takes an object off the mixer waits for that, so that no strike is
/// sent to a bank that has been given up.
class Scene {
 public:
  explicit Scene(uint64_t id, const SceneSpace& space = {}) : id_(id), space_(space) {}

  uint64_t id() const { return id_; }

  /// How it is heard, and where the listener is, as told last.
  SceneSpace space() const;

  /// Notes where an object is, and calls `use` with it.
  /// Errors: InvalidArgument (INVALID_POSE), NotFound (SCENE_NOT_FOUND, OBJECT_NOT_FOUND).
  absl::Status Move(uint32_t handle, const Pose& pose,
                    absl::FunctionRef<void(const SoundingObject&)> use);

  /// Notes where the listener is, and calls `use` with each object whose place is heard.
  /// Errors: InvalidArgument (INVALID_POSE), NotFound (SCENE_NOT_FOUND).
  absl::Status MoveListener(const Pose& pose, absl::FunctionRef<void(const SoundingObject&)> use);

  /// Calls `use` with the object while no change can happen.
  /// Errors: NotFound (SCENE_NOT_FOUND: deleted meanwhile, OBJECT_NOT_FOUND), and those of `use`.
  absl::Status Use(uint32_t handle,
                   absl::FunctionRef<absl::Status(const SoundingObject&)> use) const;

  /// The same with two objects.
  absl::Status Use(
      uint32_t first, uint32_t second,
      absl::FunctionRef<absl::Status(const SoundingObject&, const SoundingObject&)> use) const;

  /// Errors: NotFound (SCENE_NOT_FOUND, OBJECT_NOT_FOUND).
  absl::StatusOr<SoundingObject> Find(uint32_t handle) const;

  /// `handle` where it is free, or one that is when it is zero.
  /// Errors: AlreadyExists (OBJECT_EXISTS).
  absl::StatusOr<uint32_t> ChooseHandle(uint32_t handle) const;

  /// Errors: NotFound (SCENE_NOT_FOUND), AlreadyExists (OBJECT_EXISTS).
  absl::Status Insert(uint32_t handle, SoundingObject object);

  /// Puts `object` in the place of another and returns that one.
  absl::StatusOr<SoundingObject> Replace(uint32_t handle, SoundingObject object);

  /// Takes an object out and returns it.
  absl::StatusOr<SoundingObject> Remove(uint32_t handle);

  /// Takes all objects out; from now on the scene takes nothing.
  std::map<uint32_t, SoundingObject> Close();

 private:
  absl::StatusOr<std::map<uint32_t, SoundingObject>::const_iterator> Locate(uint32_t handle) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status SceneNotFound() const;

  const uint64_t id_;
  mutable Mutex mutex_;
  SceneSpace space_ ABSL_GUARDED_BY(mutex_);
  std::map<uint32_t, SoundingObject> objects_ ABSL_GUARDED_BY(mutex_);
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace carillon
