// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include "absl/status/statusor.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/api/call/call_bounds.h"
#include "server/api/call/thread_pool.h"
#include "server/base/event.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/replacing.h"

namespace carillon {

/// The streams of ModalModelService. Each stream deletes itself when its call is done. The database
/// and the pool must outlive the call.

/// The database that takes a mesh, and the log of the stored meshes.
struct UploadTarget {
  MeshStore& meshes;
  EventSink log_event;
};

grpc::ServerReadReactor<grpc::ByteBuffer>* MakeUpload(grpc::CallbackServerContext& context,
                                                      v1::UploadMeshResponse& response,
                                                      UploadTarget target, ThreadPool& pool,
                                                      CallBounds bounds);

/// The database that takes an import, whether the import may replace a model of other content, and
/// the log of the stored models.
struct ImportTarget {
  ModeDatabase& database;
  Replacing replacing;
  EventSink log_event;
};

grpc::ServerReadReactor<grpc::ByteBuffer>* MakeImport(grpc::CallbackServerContext& context,
                                                      v1::ImportModalModelResponse& response,
                                                      ImportTarget target, ThreadPool& pool,
                                                      CallBounds bounds);

grpc::ServerWriteReactor<v1::ExportModalModelResponse>* MakeExport(
    grpc::CallbackServerContext& context, const v1::ExportModalModelRequest& request,
    ModeDatabase& database, ThreadPool& pool, CallBounds bounds);

grpc::ServerWriteReactor<v1::GetShapesResponse>* MakeShapes(grpc::CallbackServerContext& context,
                                                            const v1::GetShapesRequest& request,
                                                            ModeDatabase& database,
                                                            ThreadPool& pool, CallBounds bounds);

v1::ModalModelSummary ToProto(const ModelSummary& summary);

}  // namespace carillon
