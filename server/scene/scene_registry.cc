// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_registry.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status SceneNotFound(absl::string_view name) {
  return Refusal(absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
                 absl::StrCat("there is no ", name, "; make one with SceneService.CreateScene"));
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
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_GLIDE",
                 absl::StrCat("glide_s is ", glide_s, "; it must be 0 to ", kLongestGlideS));
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

absl::StatusOr<PlacedObject> SceneRegistry::UpdateObject(uint64_t scene, uint32_t handle,
                                                         const ObjectChange& change) {
  ASSIGN_OR_RETURN(const std::shared_ptr<Scene> found, FindScene(scene));
  RETURN_IF_ERROR(ValidateGlide(change.glide_s));
  if (change.pose) RETURN_IF_ERROR(Validate(*change.pose));
  const MutexLock change_lock(&found->change_mutex());
  if (change.pose) RETURN_IF_ERROR(AwaitRoomForMoves(*found, 1));
  ASSIGN_OR_RETURN(const SoundingObject old, found->Copy(handle));
  if (change.material || change.size || change.gain || change.radiation) {
    ASSIGN_OR_RETURN(SoundingObject object, Remake(old, Changed(old.properties, change)));
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
