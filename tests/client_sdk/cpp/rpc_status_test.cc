// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/rpc_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carillon/v1/error.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon::client {
namespace {

using testing::HasSubstr;

TEST(RpcStatus, CarriesReasonMessageAndFiguresOfTheRichStatus) {
  v1::ErrorInfo error;
  error.set_reason("MESH_NOT_CLOSED");
  error.set_message("the surface has 12 open edges; close it");
  (*error.mutable_metadata())["edge_count"] = "12";
  v1::StatusDetails details;
  details.add_details()->PackFrom(error);
  const absl::Status status = FromRpc(
      grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "anything", details.SerializeAsString()),
      "unix:/x");
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  const v1::ErrorInfo received = ToErrorInfo(status);
  EXPECT_EQ(received.reason(), "MESH_NOT_CLOSED");
  EXPECT_EQ(received.message(), "the surface has 12 open edges; close it");
  EXPECT_EQ(received.metadata().at("edge_count"), "12");
}

TEST(RpcStatus, TellsHowToRepairAMessageThatIsTooLarge) {
  const absl::Status status =
      FromRpc(grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                           "Received message larger than max (2500022 vs. 2097152)"),
              "unix:/x");
  EXPECT_EQ(ToErrorInfo(status).reason(), "MESSAGE_TOO_LARGE");
  EXPECT_THAT(status.ToString(), HasSubstr("report fewer points in a step"));
}

}  // namespace
}  // namespace carillon::client
