// SPDX-License-Identifier: Apache-2.0
#include "server/api/scene_service.h"

#include <memory>
#include <optional>
#include <string>

#include "server/api/object_conversion.h"
#include "server/api/pose_conversion.h"
#include "server/api/resource_name.h"
#include "server/api/unary_call.h"

namespace carillon {

grpc::ServerUnaryReactor* SceneService::CreateScene(grpc::CallbackServerContext* context,
                                                    const v1::CreateSceneRequest* request,
                                                    v1::CreateSceneResponse* response) {
  return Answer(context, pool_, [this, request, response] {
    const absl::StatusOr<uint64_t> scene =
        scenes_.CreateScene(ToSceneSpace(request->hearing(), request->listener()));
    if (scene.ok()) response->set_name(SceneName(*scene));
    return scene.status();
  });
}

grpc::ServerUnaryReactor* SceneService::DeleteScene(grpc::CallbackServerContext* context,
                                                    const v1::DeleteSceneRequest* request,
                                                    v1::DeleteSceneResponse*) {
  return Answer(context, pool_, [this, request] {
    const absl::StatusOr<uint64_t> scene = ParseSceneName(request->name());
    return scene.ok() ? scenes_.DeleteScene(*scene) : scene.status();
  });
}

grpc::ServerUnaryReactor* SceneService::AddObject(grpc::CallbackServerContext* context,
                                                  const v1::AddObjectRequest* request,
                                                  v1::AddObjectResponse* response) {
  return Answer(context, pool_, [this, request, response] { return Add(*request, *response); });
}

grpc::ServerUnaryReactor* SceneService::UpdateObject(grpc::CallbackServerContext* context,
                                                     const v1::UpdateObjectRequest* request,
                                                     v1::UpdateObjectResponse* response) {
  return Answer(context, pool_, [this, request, response] { return Update(*request, *response); });
}

grpc::ServerUnaryReactor* SceneService::RemoveObject(grpc::CallbackServerContext* context,
                                                     const v1::RemoveObjectRequest* request,
                                                     v1::RemoveObjectResponse*) {
  return Answer(context, pool_, [this, request] {
    const absl::StatusOr<ObjectName> name = ParseObjectName(request->name());
    return name.ok() ? scenes_.RemoveObject(name->scene, name->handle) : name.status();
  });
}

grpc::ServerUnaryReactor* SceneService::UpdateListener(grpc::CallbackServerContext* context,
                                                       const v1::UpdateListenerRequest* request,
                                                       v1::UpdateListenerResponse*) {
  return Answer(context, pool_, [this, request] {
    const absl::StatusOr<uint64_t> scene = ParseSceneName(request->scene());
    if (!scene.ok()) return scene.status();
    return scenes_.UpdateListener(*scene, FromProto(request->pose()), request->glide_s());
  });
}

absl::Status SceneService::Add(const v1::AddObjectRequest& request,
                               v1::AddObjectResponse& response) {
  const absl::StatusOr<uint64_t> scene = ParseSceneName(request.scene());
  if (!scene.ok()) return scene.status();
  const absl::StatusOr<std::string> digest = ParseModelName(request.modal_model());
  if (!digest.ok()) return digest.status();
  absl::StatusOr<ObjectProperties> properties =
      ToObjectProperties(request.material(), request.size(),
                         request.has_gain() ? std::optional(request.gain()) : std::nullopt);
  if (!properties.ok()) return properties.status();
  if (request.has_pose()) properties->pose = FromProto(request.pose());
  absl::StatusOr<std::shared_ptr<const ModalModel>> model = database_.models().FindToSound(*digest);
  if (!model.ok()) return model.status();
  const absl::StatusOr<PlacedObject> placed =
      scenes_.AddObject(*scene, request.handle(), *std::move(model), *properties);
  if (!placed.ok()) return placed.status();
  *response.mutable_object() = ToProto(*scene, *placed);
  return absl::OkStatus();
}

absl::Status SceneService::Update(const v1::UpdateObjectRequest& request,
                                  v1::UpdateObjectResponse& response) {
  const absl::StatusOr<ObjectName> name = ParseObjectName(request.name());
  if (!name.ok()) return name.status();
  const absl::StatusOr<ObjectChange> change = ToObjectChange(request);
  if (!change.ok()) return change.status();
  const absl::StatusOr<PlacedObject> placed =
      scenes_.UpdateObject(name->scene, name->handle, *change);
  if (!placed.ok()) return placed.status();
  *response.mutable_object() = ToProto(name->scene, *placed);
  return absl::OkStatus();
}

}  // namespace carillon
