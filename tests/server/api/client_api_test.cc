// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/api/edge/client_limits.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

/// A daemon that waits a short while for clients, and is served over TCP, too.
class ClientApi : public ServedDaemon {
 protected:
  ClientApi()
      : ServedDaemon({.scene_grace_s = 0.2, .client_share = 0.25, .rendering_idle_s = 2},
                     {"127.0.0.1:0", "[::1]:0"}) {}

  /// A connection of its own to one of the daemon's addresses.
  static std::shared_ptr<grpc::Channel> Connect(const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  }

  static std::string CreateSceneOn(const std::shared_ptr<grpc::Channel>& channel,
                                   const v1::CreateSceneRequest& request = {}) {
    const auto stub = v1::SceneService::NewStub(channel);
    v1::CreateSceneResponse response;
    const grpc::Status status =
        Call(*stub, &v1::SceneService::Stub::CreateScene, request, response);
    return status.ok() ? response.name() : ErrorOf(status).reason();
  }

  /// Exports a model over a connection of its own, and reads all of it. Returns the reason of a
  /// refusal.
  std::string ExportAll(const v1::ExportModalModelRequest& request) {
    grpc::ClientContext context;
    const auto stub = v1::ModalModelService::NewStub(Connect(address()));
    const auto reader = stub->ExportModalModel(&context, request);
    v1::ExportModalModelResponse response;
    while (reader->Read(&response)) {
    }
    const grpc::Status status = reader->Finish();
    return status.ok() ? "" : ErrorOf(status).reason();
  }

  std::optional<v1::Scene> FindScene(const std::string& name) {
    v1::ListScenesResponse response;
    EXPECT_TRUE(Call(*scenes, &v1::SceneService::Stub::ListScenes, {}, response).ok());
    for (const v1::Scene& scene : response.scenes()) {
      if (scene.name() == name) return scene;
    }
    return std::nullopt;
  }
};

TEST_F(ClientApi, ASceneEndsAfterItsConnectionOverAnyKindOfAddress) {
  for (const std::string& address : addresses()) {
    auto channel = Connect(address);
    auto other = Connect(address);
    const std::string kept = CreateSceneOn(other);
    const std::string scene = CreateSceneOn(channel);
    EXPECT_EQ(FindScene(scene)->connection_count(), 1U) << address;
    EXPECT_FALSE(FindScene(scene)->has_ends_in_s());
    channel.reset();
    bool waited = false;
    for (auto found = FindScene(scene); found; found = FindScene(scene)) {
      waited |= found->has_ends_in_s() && found->ends_in_s() <= 0.2;
    }
    EXPECT_TRUE(waited) << address;
    EXPECT_EQ(FindScene(kept)->connection_count(), 1U) << address;
  }
}

TEST_F(ClientApi, AClientMayNotHaveMoreThanItsShareOfAllObjects) {
  const auto channel = Connect(address());
  v1::AddObjectsRequest request;
  request.set_scene(CreateSceneOn(channel));
  for (int i = 0; i < 1025; ++i) request.add_objects();  // one more than a quarter of 4096
  v1::AddObjectsResponse response;
  const auto stub = v1::SceneService::NewStub(channel);
  const grpc::Status status = Call(*stub, &v1::SceneService::Stub::AddObjects, request, response);
  EXPECT_EQ(ErrorOf(status).reason(), "CLIENT_LIMIT_REACHED");
  request.mutable_objects()->RemoveLast();
  const grpc::Status within = Call(*stub, &v1::SceneService::Stub::AddObjects, request, response);
  EXPECT_NE(ErrorOf(within).reason(), "CLIENT_LIMIT_REACHED");  // they name no model
}

TEST_F(ClientApi, ASceneThatIsToBeKeptOutlivesItsConnection) {
  auto channel = Connect(address());
  v1::CreateSceneRequest request;
  request.set_keep(true);
  const std::string kept = CreateSceneOn(channel, request);
  const std::string other = CreateSceneOn(channel);
  channel.reset();
  while (FindScene(other)) {
  }
  ASSERT_TRUE(FindScene(kept));
  EXPECT_TRUE(FindScene(kept)->keep());
  EXPECT_EQ(FindScene(kept)->connection_count(), 0U);
  EXPECT_FALSE(FindScene(kept)->has_ends_in_s());
}

TEST_F(ClientApi, OneClientHasAShareOfAllScenesAndOthersHaveTheirs) {
  const auto greedy = Connect(address());
  for (size_t i = 0; i < SceneRegistry::kMaxSceneCount / 4; ++i) {
    ASSERT_THAT(CreateSceneOn(greedy), testing::StartsWith("scenes/")) << i;
  }
  EXPECT_EQ(CreateSceneOn(greedy), "CLIENT_LIMIT_REACHED");
  // On the Unix socket a process is one client, however many connections it has.
  EXPECT_EQ(CreateSceneOn(Connect(address())), "CLIENT_LIMIT_REACHED");
  EXPECT_THAT(CreateSceneOn(Connect(addresses().back())), testing::StartsWith("scenes/"));
}

TEST_F(ClientApi, ARenderingWhoseClientSaysNothingEnds) {
  grpc::ClientContext context;
  const auto call = audio->Render(&context);
  v1::RenderRequest request;
  request.mutable_settings()->set_sample_rate_hz(48000);
  call->Write(request);
  v1::RenderResponse response;
  EXPECT_FALSE(call->Read(&response));
  ExpectRefused(call->Finish(), grpc::DEADLINE_EXCEEDED, "CLIENT_IDLE");
  while (server().clients().renderings > 0) {
  }
}

TEST_F(ClientApi, AnUploadWhoseClientSaysNothingEndsAndStoresNothing) {
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto call = models->UploadMesh(&context, &response);
  v1::UploadMeshRequest request;
  request.set_data("the first half");
  call->Write(request);
  ExpectRefused(call->Finish(), grpc::DEADLINE_EXCEEDED, "CLIENT_IDLE");
}

TEST_F(ClientApi, ExportsThatNobodyReadAreBoundedAndEnd) {
  // gRPC takes some of a model from the daemon before the client reads, but not megabytes.
  const std::string model = ImportModel(SampleModel(300, 4000));
  v1::ExportModalModelRequest request;
  request.set_name(model);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::ExportModalModelResponse>>> exports;
  for (size_t i = 0; i < kMaxExportCount / 4; ++i) {
    // Exports that share a connection would share what gRPC takes ahead, and help one another on.
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    const auto stub = v1::ModalModelService::NewStub(Connect(address()));
    exports.push_back(stub->ExportModalModel(contexts.back().get(), request));
    exports.back()->WaitForInitialMetadata();
  }
  EXPECT_EQ(ExportAll(request), "CLIENT_LIMIT_REACHED");
  std::string reason;
  do {
    reason = ExportAll(request);
  } while (reason == "CLIENT_LIMIT_REACHED");
  EXPECT_EQ(reason, "");
  // Only the export that has waited longest has surely ended by now.
  v1::ExportModalModelResponse response;
  int cancelled_count = 0;
  for (const auto& unread : exports) {
    while (unread->Read(&response)) {
    }
    cancelled_count += unread->Finish().error_code() == grpc::CANCELLED ? 1 : 0;
  }
  EXPECT_GT(cancelled_count, 0);
}

TEST_F(ClientApi, ACompressedMessageIsRefusedBeforeItIsUnpacked) {
  grpc::ClientContext context;
  context.set_compression_algorithm(GRPC_COMPRESS_GZIP);
  v1::UploadMeshResponse response;
  const auto upload = models->UploadMesh(&context, &response);
  v1::UploadMeshRequest request;
  request.set_data(std::string(size_t{1} << 20U, 'x'));
  upload->Write(request);
  upload->WritesDone();
  EXPECT_EQ(upload->Finish().error_code(), grpc::UNIMPLEMENTED);
}

}  // namespace
}  // namespace carillon
