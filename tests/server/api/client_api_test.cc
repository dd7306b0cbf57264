// SPDX-License-Identifier: Apache-2.0
//
// What one client may have, for how long, and what it may send.
#include <set>

#include "server/api/edge/client_limits.h"
#include "server/api/edge/flood_guard.h"
#include "server/api/edge/scene_leases.h"
#include "tests/server/api/served_daemon.h"
#include "tests/server/audio_device/manual_clock.h"

namespace carillon {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

/// A daemon that waits a short while for clients, and is served over TCP, too.
class ClientApi : public ServedDaemon {
 protected:
  ClientApi()
      : ServedDaemon({.scene_grace_s = 0.2, .client_share = 0.25, .rendering_idle_s = 2},
                     {"127.0.0.1:0", "[::1]:0"}) {}

  static std::string CreateSceneOn(const std::shared_ptr<grpc::Channel>& channel,
                                   const v1::CreateSceneRequest& request = {}) {
    v1::CreateSceneResponse response;
    const grpc::Status status =
        Call(*v1::SceneService::NewStub(channel), &SceneStub::CreateScene, request, response);
    return status.ok() ? response.name() : ErrorOf(status).reason();
  }

  /// Exports a model over a connection of its own, and reads all of it. Returns the reason of a
  /// refusal.
  std::string ExportAll(const v1::ExportModalModelRequest& request) {
    grpc::ClientContext context;
    const auto stub = v1::ModalModelService::NewStub(Connect(address_));
    v1::ExportModalModelResponse response;
    const grpc::Status status = ReadToEnd(*stub->ExportModalModel(&context, request), response);
    return status.ok() ? "" : ErrorOf(status).reason();
  }

  std::optional<v1::Scene> FindScene(const std::string& name) {
    const v1::ListScenesResponse listed = Called(*scenes, &SceneStub::ListScenes, {});
    for (const v1::Scene& scene : listed.scenes()) {
      if (scene.name() == name) return scene;
    }
    return std::nullopt;
  }
};

TEST_F(ClientApi, ASceneEndsAfterItsConnectionOverAnyKindOfAddress) {
  for (const std::string& address : server_->addresses()) {
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
  const auto channel = Connect(address_);
  v1::AddObjectsRequest request;
  request.set_scene(CreateSceneOn(channel));
  for (int i = 0; i < 1025; ++i) request.add_objects();  // one more than a quarter of 4096
  const auto stub = v1::SceneService::NewStub(channel);
  const auto reason = [&] {
    return ErrorOf(Call(*stub, &SceneStub::AddObjects, request)).reason();
  };
  EXPECT_EQ(reason(), "CLIENT_LIMIT_REACHED");
  request.mutable_objects()->RemoveLast();
  EXPECT_NE(reason(), "CLIENT_LIMIT_REACHED");  // they name no model
}

TEST_F(ClientApi, ASceneThatIsToBeKeptOutlivesItsConnection) {
  auto channel = Connect(address_);
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
  const auto greedy = Connect(address_);
  for (size_t i = 0; i < SceneRegistry::kMaxSceneCount / 4; ++i) {
    ASSERT_THAT(CreateSceneOn(greedy), testing::StartsWith("scenes/")) << i;
  }
  EXPECT_EQ(CreateSceneOn(greedy), "CLIENT_LIMIT_REACHED");
  // On the Unix socket a process is one client, however many connections it has.
  EXPECT_EQ(CreateSceneOn(Connect(address_)), "CLIENT_LIMIT_REACHED");
  EXPECT_THAT(CreateSceneOn(Connect(server_->addresses().back())), testing::StartsWith("scenes/"));
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
  while (server_->clients().renderings > 0) {
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
  ModalModel model = SampleModel(300, 4000);
  model.digest = std::string(64, 'b');
  const auto request = Named<v1::ExportModalModelRequest>(ImportModel(model));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::ExportModalModelResponse>>> exports;
  for (size_t i = 0; i < kMaxExportCount / 4; ++i) {
    // Exports that share a connection would share what gRPC takes ahead, and help one another on.
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    const auto stub = v1::ModalModelService::NewStub(Connect(address_));
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
    cancelled_count += ReadToEnd(*unread, response).error_code() == grpc::CANCELLED ? 1 : 0;
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

TEST(AllowedBytes, GrowWithWhatWasReceivedAndWithTime) {
  EXPECT_EQ(AllowedBytes(0, 0), 0U);
  EXPECT_EQ(AllowedBytes(6400, 10), 100 + 10'240U);
}

/// A guard beside that of the daemon, of which it sees the connections, too.
class FloodGuardTest : public ServedDaemon {
 protected:
  LimitedLog limited_log_{clock_, "clients", [](const std::string&) {}};
  ConnectionGate gate_{8};
  FloodGuard guard_{gate_, limited_log_};
};

TEST_F(FloodGuardTest, RestsUntilSomebodyIsConnectedAndThenLooksTwentyTimesASecond) {
  EXPECT_TRUE(guard_.rests());
  CreateScene();
  EXPECT_GE(guard_.Look(), FloodGuard::kPeriod);
  EXPECT_FALSE(guard_.rests());
}

class SceneLeasesTest : public testing::Test {
 protected:
  void Pass(seconds time) { clock_.SleepUntil(clock_.Monotonic() + time); }

  ManualClock clock_;
  std::set<std::string> open_{"a", "b"};
  SceneLeases leases_{clock_, seconds(60),
                      [this](const auto& each) { return open_.contains(each); }};
};

TEST_F(SceneLeasesTest, ASceneEndsAGraceAfterItsLastConnectionWasClosed) {
  leases_.Begin(1, "a", false);
  leases_.Use(1, "b");
  open_.erase("a");
  Pass(seconds(1000));
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  EXPECT_EQ(leases_.StateOf(1).connection_count, 1U);
  EXPECT_FALSE(leases_.StateOf(1).ends_in_s);
  open_.erase("b");
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  Pass(seconds(59));
  EXPECT_THAT(leases_.Expired(), IsEmpty());
  EXPECT_DOUBLE_EQ(*leases_.StateOf(1).ends_in_s, 1);
  Pass(seconds(1));
  EXPECT_THAT(leases_.Expired(), ElementsAre(1));
}

TEST_F(SceneLeasesTest, TheLongestAbandonedSceneMakesRoomFirst) {
  const auto any = [](uint64_t) { return true; };
  leases_.Begin(1, "a", false);
  leases_.Begin(2, "b", false);
  leases_.Begin(3, "c", false);
  open_ = {"a", "c"};
  EXPECT_EQ(leases_.LongestAbandoned(any), 2U);
  Pass(seconds(1));
  open_ = {"c"};
  EXPECT_EQ(leases_.LongestAbandoned(any), 2U);
  EXPECT_EQ(leases_.LongestAbandoned([](uint64_t scene) { return scene != 2; }), 1U);
  leases_.End(2);
  leases_.End(1);
  EXPECT_FALSE(leases_.LongestAbandoned(any));
}

TEST(ClientLimits, TheMemoryOfAllRenderingsIsBounded) {
  constexpr Holding kMib = Holding::kRenderingMib;
  ClientLimits limits(0.5);
  const size_t half = MostRenderingMib() / 2;
  ClientPlace first(limits, kMib, "a");
  ClientPlace second(limits, kMib, "b");
  EXPECT_TRUE(first.Grow(half - 1).ok());
  EXPECT_TRUE(first.Grow(half).ok());
  EXPECT_THAT(first.Grow(half + 1).ToString(), testing::HasSubstr("CLIENT_LIMIT_REACHED"));
  EXPECT_EQ(limits.count(kMib), half);
  EXPECT_EQ(first.most(), half);
  EXPECT_TRUE(second.Grow(half).ok());
  ClientPlace third(limits, kMib, "c");
  EXPECT_THAT(third.Grow(2).ToString(), testing::HasSubstr("TOO_MANY_CALLS"));
  first = ClientPlace();
  EXPECT_TRUE(third.Grow(2).ok());
  EXPECT_EQ(limits.count(kMib), half + 2);
}

}  // namespace
}  // namespace carillon
