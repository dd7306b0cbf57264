// SPDX-License-Identifier: Apache-2.0
//
// The functions of SceneRegistry that make oscillator banks for many objects. They lock the scene's
// change_mutex() only after the banks are made, because a thousand banks take half a second.
#include <set>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/scene/scene_registry.h"

namespace carillon {
namespace {

using ElementError = absl::FunctionRef<absl::Status(const absl::Status&, size_t)>;

absl::Status InList(const absl::Status& status, size_t index) {
  return AtElement(status, "objects", index);
}

absl::Status Alone(const absl::Status& status, size_t) { return status; }

/// Returns the handle of each object, which is the requested one or a handle that neither the scene
/// nor another object uses.
absl::StatusOr<std::vector<uint32_t>> ChooseHandles(const Scene& scene,
                                                    std::span<const NewObject> objects,
                                                    ElementError at) {
  std::set<uint32_t> taken = scene.handles();
  for (size_t i = 0; i < objects.size(); ++i) {
    const uint32_t handle = objects[i].handle;
    if (handle == 0 || taken.insert(handle).second) continue;
    const absl::Status in_scene = scene.CheckFree(handle);
    if (!in_scene.ok()) return at(in_scene, i);
    return at(Refusal(absl::StatusCode::kAlreadyExists, "OBJECT_EXISTS",
                      absl::StrCat("an object before it has the handle ", handle,
                                   ": give each its own, or 0")),
              i);
  }
  std::vector<uint32_t> handles;
  uint32_t free = 0;
  for (const NewObject& object : objects) {
    while (object.handle == 0 && !taken.insert(++free).second) {
    }
    handles.push_back(object.handle == 0 ? free : object.handle);
  }
  return handles;
}

}  // namespace

absl::StatusOr<PlacedObject> SceneRegistry::AddObject(uint64_t scene, uint32_t handle,
                                                      std::shared_ptr<const ModalModel> model,
                                                      const ObjectProperties& properties) {
  const NewObject object{.handle = handle, .model = std::move(model), .properties = properties};
  ASSIGN_OR_RETURN(std::vector<PlacedObject> placed,
                   Add(scene, std::span(&object, 1), Alone, [] { return true; }));
  return std::move(placed.front());
}

absl::StatusOr<std::vector<PlacedObject>> SceneRegistry::AddObjects(
    uint64_t scene, const std::vector<NewObject>& objects, absl::FunctionRef<bool()> goes_on) {
  return Add(scene, objects, InList, goes_on);
}

absl::StatusOr<std::vector<PlacedObject>> SceneRegistry::Add(uint64_t scene,
                                                             std::span<const NewObject> objects,
                                                             ElementError at,
                                                             absl::FunctionRef<bool()> goes_on) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  RETURN_IF_ERROR(ReserveObjects(scene, objects.size(), at));
  bool is_placed = false;
  const absl::Cleanup end = [&] { EndReservation(scene, objects.size(), is_placed); };
  RETURN_IF_ERROR(ChooseHandles(*found, objects, at).status());
  const uint64_t round = transfer_round_;
  const Pose listener = found->space().listener;
  ASSIGN_OR_RETURN(std::vector<PlacedObject> placed, MakeObjects(*found, objects, at, goes_on));
  const absl::Status status = Place(*found, objects, at, placed);
  if (!status.ok()) {
    FadeOut(placed);
    return status;
  }
  is_placed = true;
  CatchUp(*found, placed, listener);
  if (round != transfer_round_) {
    for (const PlacedObject& made : placed) TakeOverTransfer(*found, made.handle, made.object);
  }
  return placed;
}

absl::Status SceneRegistry::ReserveObjects(uint64_t scene, size_t count, ElementError at) {
  const MutexLock lock(&mutex_);
  const size_t room = kMaxObjectCount - object_count_;
  if (count <= room) {
    object_count_ += count;
    being_made_[scene] += count;
    return absl::OkStatus();
  }
  return at(Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_OBJECTS",
                    absl::StrCat("the daemon holds ", kMaxObjectCount,
                                 " objects already; remove some first")),
            room);
}

void SceneRegistry::EndReservation(uint64_t scene, size_t count, bool placed) {
  const MutexLock lock(&mutex_);
  if (!placed) object_count_ -= count;
  if ((being_made_[scene] -= count) == 0) being_made_.erase(scene);
}

absl::StatusOr<std::vector<PlacedObject>> SceneRegistry::MakeObjects(
    const Scene& scene, std::span<const NewObject> objects, ElementError at,
    absl::FunctionRef<bool()> goes_on) {
  std::vector<PlacedObject> made;
  absl::Cleanup fade_out = [&] { FadeOut(made); };
  for (size_t i = 0; i < objects.size(); ++i) {
    if (!goes_on()) return absl::CancelledError("the caller has gone");
    RETURN_IF_ERROR(scene.CheckOpen());
    absl::StatusOr<SoundingObject> object = MakeObject(scene, objects[i]);
    if (!object.ok()) return at(object.status(), i);
    made.push_back({.object = *std::move(object)});
  }
  std::move(fade_out).Cancel();
  return made;
}

void SceneRegistry::FadeOut(std::span<const PlacedObject> objects) {
  for (const PlacedObject& object : objects) mixer_.FadeOut(object.object.bank);
}

absl::Status SceneRegistry::Place(Scene& scene, std::span<const NewObject> objects, ElementError at,
                                  std::vector<PlacedObject>& made) {
  const MutexLock change_lock(&scene.change_mutex());
  ASSIGN_OR_RETURN(const std::vector<uint32_t> handles, ChooseHandles(scene, objects, at));
  for (size_t i = 0; i < made.size(); ++i) {
    made[i].handle = handles[i];
    // The first insertion fails if the scene was deleted. The others cannot fail, because every
    // change of the scene holds its change_mutex().
    RETURN_IF_ERROR(scene.Insert(handles[i], made[i].object));
  }
  return absl::OkStatus();
}

void SceneRegistry::CatchUp(Scene& scene, std::span<const PlacedObject> placed,
                            const Pose& listener) {
  const MutexLock change_lock(&scene.change_mutex());
  const Pose now = scene.space().listener;
  if (now == listener || !AwaitRoomForMoves(scene, placed.size()).ok()) return;
  const MutexLock lock(&scene.mutex());
  for (const PlacedObject& object : placed) {
    const absl::StatusOr<const SoundingObject*> found = scene.Find(object.handle);
    if (found.ok()) SendMove(*scene.moves(), **found, ListenerMove{MotionOf(now, 0)});
  }
}

absl::StatusOr<SoundingObject> SceneRegistry::MakeObject(const Scene& scene,
                                                         const NewObject& object) {
  ASSIGN_OR_RETURN(std::shared_ptr<const SoundingBody> body, bodies_.Get(object.model));
  auto voice = MakeVoice(scene.space(), object.properties.pose, mixer_.settings());
  return MakeSoundingObject(std::move(body), object.properties, {mixer_, scene.bus()},
                            std::move(voice), transfers_);
}

absl::StatusOr<SoundingObject> SceneRegistry::Remake(const SoundingObject& old,
                                                     const ObjectProperties& properties) {
  return MakeSoundingObject(old.body, properties, {mixer_, old.bus}, old.voice, transfers_);
}

void SceneRegistry::TakeOverTransfers(const std::string& model_digest) {
  ++transfer_round_;
  std::vector<std::shared_ptr<Scene>> scenes;
  {
    const MutexLock lock(&mutex_);
    for (const auto& [id, scene] : scenes_) scenes.push_back(scene);
  }
  for (const std::shared_ptr<Scene>& scene : scenes) {
    for (const auto& [handle, old] : scene->CopyAll()) {
      if (old.body->model->digest == model_digest) TakeOverTransfer(*scene, handle, old);
    }
  }
}

void SceneRegistry::TakeOverTransfer(Scene& scene, uint32_t handle, const SoundingObject& old) {
  const auto transfer = ChooseTransfer(*old.body->model, old.properties, transfers_);
  if (!transfer.ok() || *transfer == old.transfer) return;
  // An object that cannot be made anew, for instance because the mixer is full, stays unchanged.
  absl::StatusOr<SoundingObject> object = Remake(old, old.properties);
  if (!object.ok()) return;
  const MutexLock change_lock(&scene.change_mutex());
  const absl::StatusOr<SoundingObject> now = scene.Copy(handle);
  if (!now.ok() || now->bank != old.bank) {
    // The object was removed or changed meanwhile. A changed object has the new transfer already.
    mixer_.FadeOut(object->bank);
    return;
  }
  scene.Replace(handle, *std::move(object)).IgnoreError();
  mixer_.LetRingOut(old.bank);
}

}  // namespace carillon
