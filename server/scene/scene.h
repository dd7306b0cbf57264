// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"
#include "server/scene/scene_space.h"
#include "server/scene/sounding_object.h"
#include "server/synthesis/schedule/event_stream.h"

namespace carillon {

/// The objects that one client makes sound together. Safe from every thread.
///
/// Whoever sends an event to an object's bank holds mutex() from the look-up of the object until
/// the event is pushed. An object's bank is taken off the mixer only after the object was removed
/// or replaced under the same mutex, so no event is sent to a bank that is off the mixer. Where a
/// place on an object was found under an earlier lock, the object's serial tells whether the object
/// that has the handle now has the same surface.
class Scene {
 public:
  /// `name` is "scenes/{id}". The objects sound through `bus`.
  explicit Scene(std::string name, const SceneSpace& space = {}, BusId bus = {})
      : name_(std::move(name)), bus_(bus), space_(space) {}

  /// "scenes/{id}".
  const std::string& name() const { return name_; }

  BusId bus() const { return bus_; }

  Mutex& mutex() const ABSL_LOCK_RETURNED(mutex_) { return mutex_; }

  /// Held, and locked before mutex(), while objects are put into the scene, changed and removed by
  /// calls, so that two changes of one object do not undo each other. Contacts do not lock it.
  Mutex& change_mutex() const ABSL_LOCK_RETURNED(change_mutex_) { return change_mutex_; }

  /// The stream of the moves that come by a call and not in a contact stream. It is null until the
  /// first such move.
  std::unique_ptr<EventStream>& moves() ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_) {
    return moves_;
  }

  /// Returns an object. Errors: NotFound (SCENE_NOT_FOUND: the scene was deleted meanwhile,
  /// OBJECT_NOT_FOUND).
  absl::StatusOr<const SoundingObject*> Find(uint32_t handle) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  /// Returns an object, unless another one has the handle now than the one with this serial.
  /// Errors: those of Find.
  absl::StatusOr<const SoundingObject*> FindSame(uint32_t handle, uint64_t serial) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  /// Stores the pose of an object, and returns the object. Errors: InvalidArgument (INVALID_POSE),
  /// and those of Find.
  absl::StatusOr<const SoundingObject*> Move(uint32_t handle, const Pose& pose)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  /// Stores the pose of the listener, and returns all objects. Errors: InvalidArgument
  /// (INVALID_POSE), NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<const std::map<uint32_t, SoundingObject>*> MoveListener(const Pose& pose)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  /// Returns the spatial effects of the scene, with the newest pose of the listener.
  SceneSpace space() const;

  /// Errors: NotFound (SCENE_NOT_FOUND: the scene was deleted meanwhile).
  absl::Status CheckOpen() const;

  /// Returns a copy of an object. Errors: those of Find.
  absl::StatusOr<SoundingObject> Copy(uint32_t handle) const;

  /// Returns a copy of every object by its handle. The result is empty if the scene was deleted.
  std::map<uint32_t, SoundingObject> CopyAll() const;

  /// Returns the number of objects, which is zero if the scene was deleted.
  size_t object_count() const;

  /// Checks that a handle is free. Errors: AlreadyExists (OBJECT_EXISTS: an object has this
  /// handle).
  absl::Status CheckFree(uint32_t handle) const;

  /// Returns the handles of all objects.
  std::set<uint32_t> handles() const;

  /// Inserts an object, and gives it a serial that no object of the scene had before. Errors:
  /// NotFound (SCENE_NOT_FOUND), AlreadyExists (OBJECT_EXISTS).
  absl::Status Insert(uint32_t handle, SoundingObject object);

  /// Replaces the object with this handle by `object`, which has the same surface, and returns the
  /// replaced object. `object` takes over the serial, and the pose, which may have changed since
  /// `object` was made. Errors: those of Find.
  absl::StatusOr<SoundingObject> Replace(uint32_t handle, SoundingObject object);

  /// Removes an object and returns it. Errors: those of Find.
  absl::StatusOr<SoundingObject> Remove(uint32_t handle);

  /// Removes and returns all objects. From then on, every call that finds or inserts an object
  /// returns SCENE_NOT_FOUND.
  std::map<uint32_t, SoundingObject> Close();

 private:
  absl::Status CheckOpenLocked() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status ObjectExists(uint32_t handle) const;
  absl::Status ObjectNotFound(uint32_t handle) const;

  const std::string name_;
  const BusId bus_;
  mutable Mutex change_mutex_;
  std::unique_ptr<EventStream> moves_ ABSL_GUARDED_BY(change_mutex_);
  mutable Mutex mutex_ ABSL_ACQUIRED_AFTER(change_mutex_);
  SceneSpace space_ ABSL_GUARDED_BY(mutex_);
  std::map<uint32_t, SoundingObject> objects_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_serial_ ABSL_GUARDED_BY(mutex_) = 0;
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace carillon
