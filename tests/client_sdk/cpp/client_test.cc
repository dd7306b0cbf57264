// SPDX-License-Identifier: Apache-2.0
//
// What a client does without a daemon; tests/integration has the rest, with one.
#include "carillon/client.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "carillon/v1/error.pb.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/error_reason.h"

namespace carillon::client {
namespace {

using testing::HasSubstr;

class ClientWithoutDaemon : public testing::Test {
 protected:
  const std::unique_ptr<Client> client_ = Connect("unix:/proc/no/such/socket");
};

TEST_F(ClientWithoutDaemon, IsToldSoByEveryKindOfCall) {
  const auto unavailable = HasSubstr("SERVER_UNAVAILABLE: ");
  EXPECT_THAT(client_->GetServerInfo().status().ToString(), unavailable);
  EXPECT_THAT(client_->IsServing("").status().ToString(), unavailable);
  EXPECT_THAT(client_->GetMixer().status().ToString(),
              AllOf(unavailable, HasSubstr("unix:/proc/no/such/socket")));
  EXPECT_THAT(client_->UploadMesh("v 0 0 0").status().ToString(), unavailable);
  EXPECT_THAT(client_->WatchJob("jobs/a", nullptr).status().ToString(), unavailable);
  EXPECT_THAT(client_->Listen({}, [](const AudioBlock&) { return true; }).ToString(), unavailable);
  EXPECT_THAT(client_->StreamContacts({}).status().ToString(), unavailable);
}

TEST_F(ClientWithoutDaemon, RefusesAnEmptyCallbackInsteadOfCallingIt) {
  const std::string path = testing::TempDir() + "empty_callback.contacts";
  auto writer = ContactTraceWriter::Create(path, {});
  ASSERT_TRUE(writer.ok() && writer->Close().ok());
  auto trace = ContactTraceReader::Open(path);
  ASSERT_TRUE(trace.ok()) << trace.status();
  const auto refused = [](const char* name) {
    return HasSubstr(absl::StrCat("INVALID_SETTINGS: ", name, " is empty; "));
  };
  EXPECT_THAT(client_->Render({}, *trace, AudioCallback()).status().ToString(),
              refused("on_block"));
  EXPECT_THAT(client_->Listen({}, nullptr).ToString(), refused("on_block"));
  EXPECT_THAT(client_->RecordContacts("scenes/1", nullptr, nullptr).ToString(),
              refused("on_record"));
  EXPECT_THAT(client_->WatchJobs({}, nullptr).ToString(), refused("on_answer"));
}

/// Checks that each call names a method of the contract with the types of its messages.
class NamedCalls : public Client {
 public:
  mutable std::set<std::string> methods;

 protected:
  absl::Status Call(absl::string_view method, const google::protobuf::Message& request,
                    google::protobuf::Message& response) const override {
    methods.emplace(method);
    std::string name = absl::StrCat("carillon.v1.", method);
    std::ranges::replace(name, '/', '.');
    const auto* const described =
        google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(name);
    if (described == nullptr) return absl::InternalError(name);
    EXPECT_EQ(described->input_type(), request.GetDescriptor());
    EXPECT_EQ(described->output_type(), response.GetDescriptor());
    return absl::OkStatus();
  }
};

TEST(NamedCallsTest, AreThoseOfTheContract) {
  const NamedCalls client;
  const auto all_known = [](const auto&... results) { return (results.ok() && ...); };
  EXPECT_TRUE(all_known(
      client.GetServerInfo(), client.CreateModalModel({}), client.CreateTransfer({}),
      client.GetModalModel(""), client.ListModalModelsPage({}), client.UpdateModalModel({}),
      client.DeleteModalModel(""), client.ListMaterials(), client.GetJob(""),
      client.ListJobsPage({}), client.CancelJob(""), client.CreateScene(), client.GetScene(""),
      client.UpdateScene({}), client.StopAll(), client.DeleteScene(""), client.ListScenes(),
      client.ListObjects(""), client.AddObjects({}), client.UpdateObject({}),
      client.RemoveObject(""), client.UpdateListener({}), client.GetMixer(), client.UpdateMixer({}),
      client.GetDatabaseStats(), client.CollectGarbage({})));
  EXPECT_EQ(client.methods.size(), 26U);
}

TEST(WithTimeout, EndsACallThatNobodyAnswers) {
  // Connections reach this socket, but nothing reads from them.
  const int silent = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  const std::string path = testing::TempDir() + "silent.sock";
  unlink(path.c_str());
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(silent, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(listen(silent, 1), 0);
  const auto client = Connect("unix:" + path)->WithTimeout(std::chrono::milliseconds(200));
  const auto timeout = HasSubstr("SERVER_TIMEOUT: ");
  EXPECT_THAT(client->GetMixer().status().ToString(), timeout);
  EXPECT_THAT(client->WatchJob("jobs/a", nullptr).status().ToString(), timeout);
  EXPECT_THAT(client->StreamContacts({}).status().ToString(), timeout);
  close(silent);
}

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
