// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "carillon/v1/scene_service.grpc.pb.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/reception.h"
#include "server/api/convert/resource_name.h"
#include "server/api/edge/scene_owners.h"
#include "server/base/mutex.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/head_store.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// carillon.v1.SceneService. The objects that the constructor gets by reference must outlive the
/// service.
class SceneService final : public v1::SceneService::CallbackService {
 public:
  /// `adding` makes the objects of AddObjects. A thousand objects take half a second, so that a few
  /// calls would occupy all threads of the reception.
  SceneService(SceneRegistry& scenes, SceneOwners& owners, ModeDatabase& database, HeadStore& heads,
               const Reception& reception, FairTurns& adding)
      : scenes_(scenes),
        owners_(owners),
        database_(database),
        heads_(heads),
        reception_(reception),
        adding_(adding) {}

  grpc::ServerUnaryReactor* CreateScene(grpc::CallbackServerContext* context,
                                        const v1::CreateSceneRequest* request,
                                        v1::CreateSceneResponse* response) override;
  grpc::ServerUnaryReactor* GetScene(grpc::CallbackServerContext* context,
                                     const v1::GetSceneRequest* request,
                                     v1::GetSceneResponse* response) override;
  grpc::ServerUnaryReactor* UpdateScene(grpc::CallbackServerContext* context,
                                        const v1::UpdateSceneRequest* request,
                                        v1::UpdateSceneResponse* response) override;
  grpc::ServerUnaryReactor* StopAll(grpc::CallbackServerContext* context,
                                    const v1::StopAllRequest* request,
                                    v1::StopAllResponse* response) override;
  grpc::ServerUnaryReactor* DeleteScene(grpc::CallbackServerContext* context,
                                        const v1::DeleteSceneRequest* request,
                                        v1::DeleteSceneResponse* response) override;
  grpc::ServerUnaryReactor* ListScenes(grpc::CallbackServerContext* context,
                                       const v1::ListScenesRequest* request,
                                       v1::ListScenesResponse* response) override;
  grpc::ServerUnaryReactor* ListObjects(grpc::CallbackServerContext* context,
                                        const v1::ListObjectsRequest* request,
                                        v1::ListObjectsResponse* response) override;
  grpc::ServerUnaryReactor* AddObjects(grpc::CallbackServerContext* context,
                                       const v1::AddObjectsRequest* request,
                                       v1::AddObjectsResponse* response) override;
  grpc::ServerUnaryReactor* UpdateObject(grpc::CallbackServerContext* context,
                                         const v1::UpdateObjectRequest* request,
                                         v1::UpdateObjectResponse* response) override;
  grpc::ServerUnaryReactor* RemoveObject(grpc::CallbackServerContext* context,
                                         const v1::RemoveObjectRequest* request,
                                         v1::RemoveObjectResponse* response) override;
  grpc::ServerUnaryReactor* UpdateListener(grpc::CallbackServerContext* context,
                                           const v1::UpdateListenerRequest* request,
                                           v1::UpdateListenerResponse* response) override;

 private:
  /// Makes the scene, or finds the scene that the caller has made before with this id.
  absl::Status Create(const grpc::CallbackServerContext& context, const Principal& caller,
                      const v1::CreateSceneRequest& request, v1::CreateSceneResponse& response);
  absl::StatusOr<uint64_t> CreateNew(const grpc::CallbackServerContext& context,
                                     const Principal& caller, const std::string& id,
                                     const SceneWish& wish);
  absl::Status Describe(uint64_t scene, v1::Scene& described) const;
  absl::StatusOr<uint64_t> Parse(const grpc::CallbackServerContext& context,
                                 const Principal& caller, const ObjectName& name) const;
  /// Makes room for a scene of `caller`: ends the scene that was abandoned for the longest time,
  /// among those of `client` or among all. Returns false if no scene is abandoned.
  bool EndAbandoned(const Principal& caller, const std::optional<std::string>& client);
  /// Logs that a call of `caller` has deleted the scene.
  void LogDeleted(const std::string& name, const Principal& caller) const;
  /// Checks that the scene's client may have this number of further objects, in all its scenes
  /// together. Errors: ResourceExhausted (CLIENT_LIMIT_REACHED).
  absl::Status CheckObjectCount(uint64_t scene, size_t more) const;
  absl::Status Add(const grpc::CallbackServerContext& context, uint64_t scene,
                   const v1::AddObjectsRequest& request, v1::AddObjectsResponse& response);
  absl::Status Update(uint64_t scene, uint32_t handle, const v1::UpdateObjectRequest& request,
                      v1::UpdateObjectResponse& response);

  SceneRegistry& scenes_;
  SceneOwners& owners_;
  ModeDatabase& database_;
  HeadStore& heads_;
  const Reception reception_;
  FairTurns& adding_;
  /// Held while a scene with a client's id is made, so that two equal requests make one scene.
  Mutex create_mutex_;
};

}  // namespace carillon
