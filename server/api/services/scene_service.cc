// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/scene_service.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/unary_call.h"
#include "server/api/convert/object_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

v1::Scene ToProto(const SceneRegistry::SceneEntry& entry) {
  v1::Scene scene;
  scene.set_name(entry.name);
  scene.set_object_count(static_cast<uint32_t>(entry.object_count));
  scene.set_gain(entry.volume.gain);
  scene.set_muted(entry.volume.muted);
  scene.set_solo(entry.volume.solo);
  scene.set_active_mode_count(static_cast<uint32_t>(entry.state.active_mode_count));
  scene.set_peak(entry.state.peak);
  return scene;
}

void AddSpace(const absl::StatusOr<SceneSpace>& space, v1::Scene& scene) {
  if (!space.ok()) return;  // the scene was deleted meanwhile
  *scene.mutable_hearing() = ToProto(space->hearing);
  *scene.mutable_listener() = ToProto(space->listener);
}

void AddLease(const LeaseState& lease, v1::Scene& scene) {
  scene.set_keep(lease.keep);
  scene.set_connection_count(static_cast<uint32_t>(lease.connection_count));
  if (lease.ends_in_s) scene.set_ends_in_s(*lease.ends_in_s);
}

SceneVolumeChange ToVolumeChange(const v1::UpdateSceneRequest& request) {
  SceneVolumeChange change;
  if (request.has_gain()) change.gain = request.gain();
  if (request.has_muted()) change.muted = request.muted();
  if (request.has_solo()) change.solo = request.solo();
  return change;
}

}  // namespace

grpc::ServerUnaryReactor* SceneService::CreateScene(grpc::CallbackServerContext* context,
                                                    const v1::CreateSceneRequest* request,
                                                    v1::CreateSceneResponse* response) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request, response](const Principal& caller) {
                  return Create(*context, caller, *request, *response);
                });
}

grpc::ServerUnaryReactor* SceneService::GetScene(grpc::CallbackServerContext* context,
                                                 const v1::GetSceneRequest* request,
                                                 v1::GetSceneResponse* response) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request, response](const Principal& caller) {
                  ASSIGN_OR_RETURN(
                      const uint64_t scene,
                      owners_.Parse(*context, caller, request->name(), SceneCall::kLooks));
                  return Describe(scene, *response->mutable_scene());
                });
}

grpc::ServerUnaryReactor* SceneService::DeleteScene(grpc::CallbackServerContext* context,
                                                    const v1::DeleteSceneRequest* request,
                                                    v1::DeleteSceneResponse*) {
  return Answer(
      context, reception_, Role::kStrike, [this, context, request](const Principal& caller) {
        ASSIGN_OR_RETURN(const uint64_t scene, owners_.Parse(*context, caller, request->name()));
        RETURN_IF_ERROR(scenes_.DeleteScene(scene));
        owners_.Remove(scene);
        LogDeleted(request->name(), caller);
        return absl::OkStatus();
      });
}

grpc::ServerUnaryReactor* SceneService::UpdateScene(grpc::CallbackServerContext* context,
                                                    const v1::UpdateSceneRequest* request,
                                                    v1::UpdateSceneResponse* response) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request, response](const Principal& caller) {
                  ASSIGN_OR_RETURN(const uint64_t scene,
                                   owners_.Parse(*context, caller, request->name()));
                  RETURN_IF_ERROR(scenes_.ChangeVolume(scene, ToVolumeChange(*request)));
                  return Describe(scene, *response->mutable_scene());
                });
}

grpc::ServerUnaryReactor* SceneService::StopAll(grpc::CallbackServerContext* context,
                                                const v1::StopAllRequest* request,
                                                v1::StopAllResponse* response) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request, response](const Principal& caller) {
                  if (request->scene().empty()) {
                    for (const SceneRegistry::SceneEntry& entry : scenes_.ListScenes()) {
                      const bool stopped =
                          owners_.Owns(caller, entry.scene) && scenes_.Stop(entry.scene).ok();
                      if (stopped) response->set_scene_count(response->scene_count() + 1);
                    }
                    return absl::OkStatus();
                  }
                  ASSIGN_OR_RETURN(const uint64_t scene,
                                   owners_.Parse(*context, caller, request->scene()));
                  RETURN_IF_ERROR(scenes_.Stop(scene));
                  response->set_scene_count(1);
                  return absl::OkStatus();
                });
}

grpc::ServerUnaryReactor* SceneService::ListScenes(grpc::CallbackServerContext* context,
                                                   const v1::ListScenesRequest*,
                                                   v1::ListScenesResponse* response) {
  return Answer(context, reception_, Role::kStrike, [this, response](const Principal& caller) {
    for (const SceneRegistry::SceneEntry& entry : scenes_.ListScenes()) {
      if (!owners_.Owns(caller, entry.scene)) continue;
      v1::Scene& scene = *response->add_scenes();
      scene = ToProto(entry);
      AddLease(owners_.leases().StateOf(entry.scene), scene);
      AddSpace(scenes_.SpaceOf(entry.scene), scene);
    }
    return absl::OkStatus();
  });
}

grpc::ServerUnaryReactor* SceneService::ListObjects(grpc::CallbackServerContext* context,
                                                    const v1::ListObjectsRequest* request,
                                                    v1::ListObjectsResponse* response) {
  return Answer(
      context, reception_, Role::kStrike,
      [this, context, request, response](const Principal& caller) {
        ASSIGN_OR_RETURN(const uint64_t scene,
                         owners_.Parse(*context, caller, request->scene(), SceneCall::kLooks));
        ASSIGN_OR_RETURN(const std::vector<PlacedObject> objects, scenes_.ListObjects(scene));
        const std::string name = scenes_.NameOf(scene);
        for (const PlacedObject& placed : objects) *response->add_objects() = ToProto(name, placed);
        return absl::OkStatus();
      });
}

grpc::ServerUnaryReactor* SceneService::AddObjects(grpc::CallbackServerContext* context,
                                                   const v1::AddObjectsRequest* request,
                                                   v1::AddObjectsResponse* response) {
  return AnswerFairly(
      context, reception_, adding_, [this, context, request, response](const Principal& caller) {
        ASSIGN_OR_RETURN(const uint64_t scene, owners_.Parse(*context, caller, request->scene()));
        return Add(*context, scene, *request, *response);
      });
}

grpc::ServerUnaryReactor* SceneService::UpdateObject(grpc::CallbackServerContext* context,
                                                     const v1::UpdateObjectRequest* request,
                                                     v1::UpdateObjectResponse* response) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request, response](const Principal& caller) {
                  ASSIGN_OR_RETURN(const ObjectName name, ParseObjectName(request->name()));
                  ASSIGN_OR_RETURN(const uint64_t scene, Parse(*context, caller, name));
                  return Update(scene, name.handle, *request, *response);
                });
}

grpc::ServerUnaryReactor* SceneService::RemoveObject(grpc::CallbackServerContext* context,
                                                     const v1::RemoveObjectRequest* request,
                                                     v1::RemoveObjectResponse*) {
  return Answer(context, reception_, Role::kStrike,
                [this, context, request](const Principal& caller) {
                  ASSIGN_OR_RETURN(const ObjectName name, ParseObjectName(request->name()));
                  ASSIGN_OR_RETURN(const uint64_t scene, Parse(*context, caller, name));
                  return scenes_.RemoveObject(scene, name.handle);
                });
}

grpc::ServerUnaryReactor* SceneService::UpdateListener(grpc::CallbackServerContext* context,
                                                       const v1::UpdateListenerRequest* request,
                                                       v1::UpdateListenerResponse*) {
  return Answer(
      context, reception_, Role::kStrike, [this, context, request](const Principal& caller) {
        ASSIGN_OR_RETURN(const uint64_t scene, owners_.Parse(*context, caller, request->scene()));
        return scenes_.UpdateListener(scene, FromProto(request->pose()), request->glide_s());
      });
}

absl::Status SceneService::Create(const grpc::CallbackServerContext& context,
                                  const Principal& caller, const v1::CreateSceneRequest& request,
                                  v1::CreateSceneResponse& response) {
  SceneWish wish{.space = ToSceneSpace(request.hearing(), request.listener()),
                 .gain = request.has_gain() ? request.gain() : 1,
                 .keep = request.keep()};
  const MixerSettings& mixer = scenes_.mixer_settings();
  RETURN_IF_ERROR(heads_.Complete(wish.space, static_cast<uint32_t>(mixer.sample_rate_hz),
                                  static_cast<uint32_t>(mixer.channel_count)));
  const std::string& id = request.id();
  if (!id.empty()) {
    RETURN_IF_ERROR(ValidateSceneId(id));
    const MutexLock lock(&create_mutex_);
    const absl::StatusOr<uint64_t> known = scenes_.FindId(id);
    response.set_existing(known.ok());
    if (known.ok()) {
      RETURN_IF_ERROR(owners_.CheckMadeBy(context, caller, *known, wish));
    } else {
      RETURN_IF_ERROR(CreateNew(context, caller, id, wish).status());
    }
    response.set_name(absl::StrCat("scenes/", id));
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const uint64_t scene, CreateNew(context, caller, id, wish));
  response.set_name(scenes_.NameOf(scene));
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> SceneService::CreateNew(const grpc::CallbackServerContext& context,
                                                 const Principal& caller, const std::string& id,
                                                 const SceneWish& wish) {
  absl::StatusOr<ClientPlace> place = reception_.limits.Take(Holding::kScene, caller.client);
  if (!place.ok() && EndAbandoned(caller, caller.client)) {
    place = reception_.limits.Take(Holding::kScene, caller.client);
  }
  if (!place.ok()) return reception_.access.Refuse(context, caller.function, place.status());
  absl::StatusOr<uint64_t> scene = scenes_.CreateScene(wish.space, wish.gain, caller.name, id);
  if (absl::IsResourceExhausted(scene.status()) && EndAbandoned(caller, std::nullopt)) {
    scene = scenes_.CreateScene(wish.space, wish.gain, caller.name, id);
  }
  RETURN_IF_ERROR(scene.status());
  owners_.Add(*scene, caller, *std::move(place), wish);
  reception_.events.LogLimited(
      Event("scene_created", LogLevel::kDebug).With("scene", scenes_.NameOf(*scene)), caller);
  return scene;
}

absl::Status SceneService::Describe(uint64_t scene, v1::Scene& described) const {
  ASSIGN_OR_RETURN(const SceneRegistry::SceneEntry entry, scenes_.GetScene(scene));
  described = ToProto(entry);
  AddLease(owners_.leases().StateOf(scene), described);
  AddSpace(scenes_.SpaceOf(scene), described);
  return absl::OkStatus();
}

absl::StatusOr<uint64_t> SceneService::Parse(const grpc::CallbackServerContext& context,
                                             const Principal& caller,
                                             const ObjectName& name) const {
  ASSIGN_OR_RETURN(const uint64_t scene, scenes_.FindId(name.scene));
  RETURN_IF_ERROR(owners_.Check(context, caller, scene));
  return scene;
}

bool SceneService::EndAbandoned(const Principal& caller, const std::optional<std::string>& client) {
  const std::optional<uint64_t> abandoned = owners_.LongestAbandoned(client);
  if (!abandoned) return false;
  const std::string name = scenes_.NameOf(*abandoned);
  if (scenes_.DeleteScene(*abandoned).ok()) LogDeleted(name, caller);
  owners_.Remove(*abandoned);
  return true;
}

void SceneService::LogDeleted(const std::string& name, const Principal& caller) const {
  reception_.events.LogLimited(Event("scene_deleted", LogLevel::kDebug).With("scene", name),
                               caller);
}

absl::Status SceneService::CheckObjectCount(uint64_t scene, size_t more) const {
  const size_t held = scenes_.CountObjects(owners_.ScenesOfItsClient(scene));
  return reception_.limits.Check("objects", SceneRegistry::kMaxObjectCount, held, more);
}

absl::Status SceneService::Add(const grpc::CallbackServerContext& context, uint64_t scene,
                               const v1::AddObjectsRequest& request,
                               v1::AddObjectsResponse& response) {
  RETURN_IF_ERROR(CheckObjectCount(scene, static_cast<size_t>(request.objects_size())));
  std::vector<NewObject> objects;
  for (const v1::NewObject& wanted : request.objects()) {
    if (context.IsCancelled()) return absl::CancelledError("the caller has gone");
    absl::StatusOr<ObjectOfModel> object = ToObject(wanted, database_.models());
    if (!object.ok() && request.objects_size() == 1) return object.status();
    if (!object.ok()) return AtElement(object.status(), "objects", objects.size());
    objects.push_back({.handle = wanted.handle(),
                       .model = std::move(object->model),
                       .properties = std::move(object->properties)});
  }
  // The models may have been read from the disk meanwhile, and other calls may have added objects.
  RETURN_IF_ERROR(CheckObjectCount(scene, objects.size()));
  ASSIGN_OR_RETURN(
      const std::vector<PlacedObject> placed,
      scenes_.AddObjects(scene, objects, [&context] { return !context.IsCancelled(); }));
  const std::string name = scenes_.NameOf(scene);
  for (const PlacedObject& made : placed) *response.add_objects() = ToProto(name, made);
  return absl::OkStatus();
}

absl::Status SceneService::Update(uint64_t scene, uint32_t handle,
                                  const v1::UpdateObjectRequest& request,
                                  v1::UpdateObjectResponse& response) {
  ASSIGN_OR_RETURN(const ObjectChange change, ToObjectChange(request));
  ASSIGN_OR_RETURN(const PlacedObject placed, scenes_.UpdateObject(scene, handle, change));
  *response.mutable_object() = ToProto(scenes_.NameOf(scene), placed);
  return absl::OkStatus();
}

}  // namespace carillon
