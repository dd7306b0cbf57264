// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_registry.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

absl::Status TooMany(absl::string_view reason, size_t limit, absl::string_view what) {
  return Refusal(
      absl::StatusCode::kResourceExhausted, reason,
      absl::StrCat("the daemon holds ", limit, " ", what, " already; remove some first"));
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
  if (change.pose) properties.pose = change.pose;
  return properties;
}

absl::Status ValidateGlide(double glide_s) {
  constexpr double kLongestGlideS = 10;
  if (glide_s >= 0 && glide_s <= kLongestGlideS) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_GLIDE",
                 absl::StrCat("glide_s is ", glide_s, "; it must be 0 to ", kLongestGlideS));
}

}  // namespace

absl::StatusOr<uint64_t> SceneRegistry::CreateScene(const SceneSpace& space) {
  if (absl::Status status = Validate(space); !status.ok()) return status;
  const MutexLock lock(&mutex_);
  if (scenes_.size() >= kMaxSceneCount) {
    return TooMany("TOO_MANY_SCENES", kMaxSceneCount, "scenes");
  }
  const uint64_t id = next_scene_++;
  scenes_[id] = std::make_shared<Scene>(id, space);
  return id;
}

absl::Status SceneRegistry::DeleteScene(uint64_t scene) {
  const MutexLock change_lock(&change_mutex_);
  absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  const std::map<uint32_t, SoundingObject> objects = (*found)->Close();
  for (const auto& [handle, object] : objects) mixer_.FadeOut(object.bank);
  const MutexLock lock(&mutex_);
  scenes_.erase(scene);
  object_count_ -= objects.size();
  return absl::OkStatus();
}

absl::StatusOr<PlacedObject> SceneRegistry::AddObject(uint64_t scene, uint32_t handle,
                                                      std::shared_ptr<const ModalModel> model,
                                                      const ObjectProperties& properties) {
  const MutexLock change_lock(&change_mutex_);
  const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  const absl::StatusOr<uint32_t> chosen = (*found)->ChooseHandle(handle);
  if (!chosen.ok()) return chosen.status();
  if (object_count() >= kMaxObjectCount) {
    return TooMany("TOO_MANY_OBJECTS", kMaxObjectCount, "objects");
  }
  absl::StatusOr<std::shared_ptr<const SoundingBody>> body = bodies_.Get(std::move(model));
  if (!body.ok()) return body.status();
  absl::StatusOr<SoundingObject> object =
      MakeSoundingObject(*std::move(body), properties, mixer_,
                         MakeVoice((*found)->space(), properties.pose, mixer_.settings()));
  if (!object.ok()) return object.status();
  // Nothing can be in its way: every change holds change_mutex_.
  (*found)->Insert(*chosen, *object).IgnoreError();
  const MutexLock lock(&mutex_);
  ++object_count_;
  return PlacedObject{.handle = *chosen, .object = *std::move(object)};
}

absl::StatusOr<PlacedObject> SceneRegistry::UpdateObject(uint64_t scene, uint32_t handle,
                                                         const ObjectChange& change) {
  const MutexLock change_lock(&change_mutex_);
  const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  if (absl::Status status = ValidateGlide(change.glide_s); !status.ok()) return status;
  if (change.pose) {
    if (absl::Status status = Validate(*change.pose); !status.ok()) return status;
  }
  const absl::StatusOr<SoundingObject> old = (*found)->Find(handle);
  if (!old.ok()) return old.status();
  if (change.material || change.size || change.gain) {
    absl::StatusOr<SoundingObject> object =
        MakeSoundingObject(old->body, Changed(old->properties, change), mixer_, old->voice);
    if (!object.ok()) return object.status();
    (*found)->Replace(handle, *std::move(object)).IgnoreError();
    mixer_.LetRingOut(old->bank);
  }
  if (change.pose) {
    if (absl::Status status = OpenMoves(); !status.ok()) return status;
    (*found)
        ->Move(handle, *change.pose,
               [&](const SoundingObject& object) ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_) {
                 SendMove(object, ObjectMove{MotionOf(*change.pose, change.glide_s)});
               })
        .IgnoreError();
  }
  absl::StatusOr<SoundingObject> object = (*found)->Find(handle);
  if (!object.ok()) return object.status();
  return PlacedObject{.handle = handle, .object = *std::move(object)};
}

absl::Status SceneRegistry::UpdateListener(uint64_t scene, const Pose& pose, double glide_s) {
  const MutexLock change_lock(&change_mutex_);
  const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  if (absl::Status status = ValidateGlide(glide_s); !status.ok()) return status;
  if (absl::Status status = OpenMoves(); !status.ok()) return status;
  return (*found)->MoveListener(
      pose, [&](const SoundingObject& object) ABSL_EXCLUSIVE_LOCKS_REQUIRED(change_mutex_) {
        SendMove(object, ListenerMove{MotionOf(pose, glide_s)});
      });
}

absl::Status SceneRegistry::OpenMoves() {
  if (moves_ != nullptr) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<EventStream>> moves = mixer_.OpenStream(kMaxObjectCount);
  if (!moves.ok()) return moves.status();
  moves_ = *std::move(moves);
  return absl::OkStatus();
}

/// Of time zero: it comes at once.
void SceneRegistry::SendMove(const SoundingObject& object, const MixerEvent::Action& move) {
  if (object.voice != nullptr) moves_->TryPush({.bank = object.bank, .action = move});
}

Motion SceneRegistry::MotionOf(const Pose& pose, double glide_s) const {
  return MotionTo(pose, glide_s * mixer_.settings().sample_rate_hz);
}

absl::Status SceneRegistry::RemoveObject(uint64_t scene, uint32_t handle) {
  const MutexLock change_lock(&change_mutex_);
  const absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  const absl::StatusOr<SoundingObject> removed = (*found)->Remove(handle);
  if (!removed.ok()) return removed.status();
  mixer_.FadeOut(removed->bank);
  const MutexLock lock(&mutex_);
  --object_count_;
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<ContactStream>> SceneRegistry::OpenContactStream(
    uint64_t scene, const ContactStreamSettings& settings) {
  absl::StatusOr<std::shared_ptr<Scene>> found = FindScene(scene);
  if (!found.ok()) return found.status();
  return ContactStream::Make(*std::move(found), mixer_, settings);
}

size_t SceneRegistry::object_count() const {
  const MutexLock lock(&mutex_);
  return object_count_;
}

absl::StatusOr<std::shared_ptr<Scene>> SceneRegistry::FindScene(uint64_t scene) const {
  const MutexLock lock(&mutex_);
  if (const auto found = scenes_.find(scene); found != scenes_.end()) return found->second;
  return Refusal(
      absl::StatusCode::kNotFound, "SCENE_NOT_FOUND",
      absl::StrCat("there is no scenes/", scene, "; make one with SceneService.CreateScene"));
}

}  // namespace carillon
