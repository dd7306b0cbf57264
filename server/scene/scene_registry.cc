// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_registry.h"

#include <set>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status SceneNotFound(absl::string_view name) {
  return Refusal(absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
                 absl::StrCat("there is no ", name,
                              "; name one that is there (ListScenes), or make one (CreateScene)"));
}

ObjectProperties Changed(ObjectProperties properties, const ObjectChange& change) {
  if (change.material) {
    const double size = properties.material.size;
    properties.material = *change.material;
    properties.material.size = size;
    properties.poisson_ratio = change.poisson_ratio;
  }
  if (change.size) properties.material.size = *change.size;
  if (change.gain) properties.gain = *change.gain;
  if (change.radiation) properties.radiation = *change.radiation;
  return properties;
}

absl::Status ValidateGlide(double glide_s) {
  constexpr double kLongestGlideS = 10;
  if (glide_s >= 0 && glide_s <= kLongestGlideS) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat("glide_s is ", glide_s, "; it must be 0 to ", kLongestGlideS));
}

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

absl::StatusOr<uint64_t> SceneRegistry::CreateScene(const SceneSpace& space, double gain,
                                                    const std::string& owner,
                                                    const std::string& id) {
  RETURN_IF_ERROR(Validate(space));
  const MutexLock lock(&mutex_);
  if (numbers_.contains(id)) {
    return Refusal(absl::StatusCode::kAlreadyExists, "SCENE_ID_TAKEN",
                   absl::StrCat("there is a scenes/", id, " already: choose another id"));
  }
  if (scenes_.size() >= kMaxSceneCount) {
    return Refusal(
        absl::StatusCode::kResourceExhausted, "TOO_MANY_SCENES",
        absl::StrCat("the daemon holds ", kMaxSceneCount, " scenes already; remove some first"));
  }
  const uint64_t number = next_scene_++;
  ASSIGN_OR_RETURN(const BusId bus, volumes_.Open(number, owner, gain));
  const std::string chosen = id.empty() ? absl::StrCat(number) : id;
  scenes_[number] = std::make_shared<Scene>(absl::StrCat("scenes/", chosen), space, bus);
  numbers_[chosen] = number;
  return number;
}

absl::StatusOr<uint64_t> SceneRegistry::FindId(const std::string& id) const {
  const MutexLock lock(&mutex_);
  if (const auto found = numbers_.find(id); found != numbers_.end()) return found->second;
  constexpr size_t kMostShown = 64;
  return SceneNotFound(absl::StrCat("scenes/", id.substr(0, kMostShown)));
}

std::string SceneRegistry::NameOf(uint64_t scene) const {
  const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  return found.ok() ? (*found)->name() : absl::StrCat("scenes/", scene);
}

absl::Status SceneRegistry::DeleteScene(uint64_t scene) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  const MutexLock change_lock(&found->change_mutex());
  RETURN_IF_ERROR(found->CheckOpen());
  const std::map<uint32_t, SoundingObject> objects = found->Close();
  for (const auto& [handle, object] : objects) mixer_.FadeOut(object.bank);
  volumes_.Close(scene);
  const MutexLock lock(&mutex_);
  scenes_.erase(scene);
  std::erase_if(numbers_, [scene](const auto& entry) { return entry.second == scene; });
  object_count_ -= objects.size();
  return absl::OkStatus();
}

std::vector<SceneRegistry::SceneEntry> SceneRegistry::ListScenes() const {
  std::map<uint64_t, std::shared_ptr<Scene>> scenes;
  {
    const MutexLock lock(&mutex_);
    scenes = scenes_;
  }
  std::vector<SceneEntry> entries;
  entries.reserve(scenes.size());
  for (const auto& [id, scene] : scenes) {
    entries.push_back(EntryOf(id, *scene));
  }
  return entries;
}

size_t SceneRegistry::CountObjects(std::span<const uint64_t> scenes) const {
  size_t count = 0;
  for (const uint64_t scene : scenes) {
    const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
    if (found.ok()) count += (*found)->object_count();
    const MutexLock lock(&mutex_);
    if (const auto made = being_made_.find(scene); made != being_made_.end()) {
      count += made->second;
    }
  }
  return count;
}

SceneRegistry::SceneEntry SceneRegistry::EntryOf(uint64_t id, const Scene& scene) const {
  return {.scene = id,
          .name = scene.name(),
          .object_count = scene.object_count(),
          .volume = volumes_.volume(id),
          .state = mixer_.State(scene.bus())};
}

absl::StatusOr<SceneRegistry::SceneEntry> SceneRegistry::GetScene(uint64_t scene) const {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  return EntryOf(scene, *found);
}

absl::Status SceneRegistry::ChangeVolume(uint64_t scene, const SceneVolumeChange& change) {
  RETURN_IF_ERROR(FindScene(scene).status());
  return volumes_.Change(scene, change);
}

absl::Status SceneRegistry::Stop(uint64_t scene) {
  ASSIGN_OR_RETURN(const BusId bus, BusOf(scene));
  mixer_.Stop(bus);
  return absl::OkStatus();
}

absl::StatusOr<BusId> SceneRegistry::BusOf(uint64_t scene) const {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  return found->bus();
}

absl::StatusOr<SceneSpace> SceneRegistry::SpaceOf(uint64_t scene) const {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  return found->space();
}

absl::StatusOr<std::vector<PlacedObject>> SceneRegistry::ListObjects(uint64_t scene) const {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  std::vector<PlacedObject> placed;
  for (auto& [handle, object] : found->CopyAll()) {
    placed.push_back({.handle = handle, .object = object});
  }
  return placed;
}

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
  return Add(scene, objects, objects.size() > 1 ? InList : Alone, goes_on);
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
    absl::StatusOr<SoundingObject> object = maker_.Make(scene, objects[i]);
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
  // An object that cannot be made anew, for instance because the mixer is full, stays unchanged.
  if (maker_.HasBestTransfer(old)) return;
  absl::StatusOr<SoundingObject> object = maker_.Remake(old, old.properties);
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

absl::StatusOr<PlacedObject> SceneRegistry::UpdateObject(uint64_t scene, uint32_t handle,
                                                         const ObjectChange& change) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  RETURN_IF_ERROR(ValidateGlide(change.glide_s));
  if (change.pose) RETURN_IF_ERROR(Validate(*change.pose));
  const MutexLock change_lock(&found->change_mutex());
  if (change.pose) RETURN_IF_ERROR(AwaitRoomForMoves(*found, 1));
  ASSIGN_OR_RETURN(const SoundingObject old, found->Copy(handle));
  if (change.material || change.size || change.gain || change.radiation) {
    ASSIGN_OR_RETURN(SoundingObject object, maker_.Remake(old, Changed(old.properties, change)));
    found->Replace(handle, std::move(object)).IgnoreError();
    mixer_.LetRingOut(old.bank);
  }
  if (change.pose) {
    const MutexLock lock(&found->mutex());
    ASSIGN_OR_RETURN(const SoundingObject* object, found->Move(handle, *change.pose));
    SendMove(*found->moves(), *object, ObjectMove{MotionOf(*change.pose, change.glide_s)});
  }
  ASSIGN_OR_RETURN(SoundingObject object, found->Copy(handle));
  return PlacedObject{.handle = handle, .object = std::move(object)};
}

absl::Status SceneRegistry::UpdateListener(uint64_t scene, const Pose& pose, double glide_s) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  RETURN_IF_ERROR(ValidateGlide(glide_s));
  const MutexLock change_lock(&found->change_mutex());
  RETURN_IF_ERROR(AwaitRoomForMoves(*found, found->object_count()));
  const MutexLock lock(&found->mutex());
  ASSIGN_OR_RETURN(const auto* objects, found->MoveListener(pose));
  for (const auto& [handle, object] : *objects) {
    SendMove(*found->moves(), object, ListenerMove{MotionOf(pose, glide_s)});
  }
  return absl::OkStatus();
}

absl::Status SceneRegistry::AwaitRoomForMoves(Scene& scene, size_t count) {
  std::unique_ptr<EventStream>& moves = scene.moves();
  if (moves == nullptr) {
    ASSIGN_OR_RETURN(moves, mixer_.OpenStream(kMaxObjectCount, StreamKind::kMoves));
  }
  if (moves->room() < count) mixer_.Wake();
  // The mixer takes thousands of events in each block.
  constexpr absl::Duration kLongest = absl::Milliseconds(200), kPause = absl::Microseconds(500);
  for (absl::Duration waited; moves->room() < count; waited += kPause) {
    if (waited >= kLongest) {
      return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_MOVES",
                     "the mixer has not taken the poses of earlier calls yet, so nothing was "
                     "moved: call again, or send poses in a contact stream");
    }
    absl::SleepFor(kPause);
  }
  return absl::OkStatus();
}

/// The event has time zero, so it takes effect at once.
void SceneRegistry::SendMove(EventStream& moves, const SoundingObject& object,
                             const MixerEvent::Action& move) {
  if (object.voice != nullptr) moves.TryPush({.bank = object.bank, .action = move});
}

Motion SceneRegistry::MotionOf(const Pose& pose, double glide_s) const {
  return MotionTo(pose, glide_s * mixer_.settings().sample_rate_hz);
}

absl::Status SceneRegistry::RemoveObject(uint64_t scene, uint32_t handle) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  const MutexLock change_lock(&found->change_mutex());
  ASSIGN_OR_RETURN(const SoundingObject removed, found->Remove(handle));
  mixer_.FadeOut(removed.bank);
  const MutexLock lock(&mutex_);
  --object_count_;
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<ContactStream>> SceneRegistry::OpenContactStream(
    uint64_t scene, const ContactStreamSettings& settings) {
  ASSIGN_OR_RETURN(std::shared_ptr<Scene> found, FindScene(scene));
  ContactStreamSettings counted = settings;
  counted.rejections = &rejections_;
  return ContactStream::Make(std::move(found), mixer_, counted);
}

size_t SceneRegistry::object_count() const {
  const MutexLock lock(&mutex_);
  return object_count_;
}

size_t SceneRegistry::scene_count() const {
  const MutexLock lock(&mutex_);
  return scenes_.size();
}

absl::StatusOr<std::shared_ptr<Scene>> SceneRegistry::FindScene(uint64_t scene) const {
  const MutexLock lock(&mutex_);
  if (const auto found = scenes_.find(scene); found != scenes_.end()) return found->second;
  return SceneNotFound(absl::StrCat("scenes/", scene));
}

}  // namespace carillon
