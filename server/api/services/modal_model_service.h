// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "server/api/call/call_bounds.h"
#include "server/api/call/raw_service.h"
#include "server/api/call/reception.h"
#include "server/base/clock.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/mode_database/mode_database.h"

namespace carillon {

/// The parts of the daemon that the calls about models use.
struct ModelContext {
  ModeDatabase& database;
  DecompositionQueue& queue;
  Reception reception;
  Reception writing;  ///< its pool runs the calls that change the database
  IdleCalls& idle_calls;
  const Clock& clock;
  double sample_rate_hz = 0;  ///< of the daemon's sound
};

/// carillon.v1.ModalModelService. The objects that the constructor gets by reference must outlive
/// the service.
class ModalModelService final : public RawService<v1::ModalModelService> {
 public:
  explicit ModalModelService(const ModelContext& daemon)
      : daemon_(daemon), database_(daemon.database), queue_(daemon.queue) {
    ReadRaw("UploadMesh", &ModalModelService::UploadMeshRaw);
    ReadRaw("ImportModalModel", &ModalModelService::ImportModalModelRaw);
  }

  grpc::ServerUnaryReactor* CreateModalModel(grpc::CallbackServerContext* context,
                                             const v1::CreateModalModelRequest* request,
                                             v1::CreateModalModelResponse* response) override;
  grpc::ServerUnaryReactor* CreateTransfer(grpc::CallbackServerContext* context,
                                           const v1::CreateTransferRequest* request,
                                           v1::CreateTransferResponse* response) override;
  grpc::ServerUnaryReactor* GetModalModel(grpc::CallbackServerContext* context,
                                          const v1::GetModalModelRequest* request,
                                          v1::GetModalModelResponse* response) override;
  grpc::ServerUnaryReactor* ListModalModels(grpc::CallbackServerContext* context,
                                            const v1::ListModalModelsRequest* request,
                                            v1::ListModalModelsResponse* response) override;
  grpc::ServerUnaryReactor* UpdateModalModel(grpc::CallbackServerContext* context,
                                             const v1::UpdateModalModelRequest* request,
                                             v1::UpdateModalModelResponse* response) override;
  grpc::ServerUnaryReactor* DeleteModalModel(grpc::CallbackServerContext* context,
                                             const v1::DeleteModalModelRequest* request,
                                             v1::DeleteModalModelResponse* response) override;
  grpc::ServerWriteReactor<v1::ExportModalModelResponse>* ExportModalModel(
      grpc::CallbackServerContext* context, const v1::ExportModalModelRequest* request) override;
  grpc::ServerWriteReactor<v1::GetShapesResponse>* GetShapes(
      grpc::CallbackServerContext* context, const v1::GetShapesRequest* request) override;
  grpc::ServerUnaryReactor* ListMaterials(grpc::CallbackServerContext* context,
                                          const v1::ListMaterialsRequest* request,
                                          v1::ListMaterialsResponse* response) override;

 private:
  grpc::ServerReadReactor<grpc::ByteBuffer>* UploadMeshRaw(grpc::CallbackServerContext* context,
                                                           v1::UploadMeshResponse* response);
  grpc::ServerReadReactor<grpc::ByteBuffer>* ImportModalModelRaw(
      grpc::CallbackServerContext* context, v1::ImportModalModelResponse* response);
  absl::Status Get(const v1::GetModalModelRequest& request, v1::GetModalModelResponse& response);
  absl::Status CheckMaterial(const v1::Material& material, const std::string& digest);
  /// Gives a material for a model of several materials the model's reference.
  absl::Status TakeReference(const std::string& digest, v1::Material& material);
  bool MayRemember(const std::string& digest, const v1::Material& material,
                   const Principal& caller);
  absl::Status Update(const v1::UpdateModalModelRequest& request, const Principal& caller,
                      v1::UpdateModalModelResponse& response);
  absl::Status List(const v1::ListModalModelsRequest& request,
                    v1::ListModalModelsResponse& response);

  CallBounds BoundsOf(ClientPlace place) const;

  const ModelContext daemon_;
  ModeDatabase& database_;
  DecompositionQueue& queue_;
};

}  // namespace carillon
