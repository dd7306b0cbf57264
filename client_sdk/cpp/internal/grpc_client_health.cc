// SPDX-License-Identifier: Apache-2.0
//
// The call of gRPC's own protocol of health, grpc.health.v1.
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>

#include <chrono>

#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

// HealthCheckRequest has the bytes of a StringValue, and HealthCheckResponse those of an
// Int32Value. Its code generated from health.proto would be one more file that users need.
using HealthRequest = google::protobuf::StringValue;
using HealthResponse = google::protobuf::Int32Value;

constexpr char kCheck[] = "/grpc.health.v1.Health/Check";
/// HealthCheckResponse.ServingStatus.SERVING
constexpr int kServing = 1;

}  // namespace

absl::StatusOr<bool> GrpcClient::IsServing(const std::string& service) const {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kHealthTimeout);
  HealthRequest request;
  request.set_value(service);
  HealthResponse response;
  grpc::Status status;
  grpc::CompletionQueue queue;
  grpc::TemplatedGenericStub<HealthRequest, HealthResponse> stub(stubs_->channel);
  const auto call = stub.PrepareUnaryCall(&context, kCheck, request, &queue);
  call->StartCall();
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  RETURN_IF_ERROR(FromRpc(status, stubs_->server));
  return response.value() == kServing;
}

}  // namespace carillon::client
