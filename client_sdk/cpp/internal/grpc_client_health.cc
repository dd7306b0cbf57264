// SPDX-License-Identifier: Apache-2.0
//
// The call of gRPC's own protocol of health, grpc.health.v1.
#include <google/protobuf/wrappers.pb.h>
#include <grpcpp/client_context.h>

#include <chrono>

#include "client_sdk/cpp/internal/grpc_client.h"
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
  context.set_deadline(std::chrono::system_clock::now() + timeout_.value_or(kHealthTimeout));
  HealthRequest request;
  request.set_value(service);
  HealthResponse response;
  RETURN_IF_ERROR(CallByPath(kCheck, request, response, context));
  return response.value() == kServing;
}

}  // namespace carillon::client
