// SPDX-License-Identifier: Apache-2.0
//
// Scenes with ids of the client's choice, and many objects in one call.
#include <functional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/base/sha256.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

v1::CreateSceneRequest Wanted(const std::string& id) {
  v1::CreateSceneRequest request;
  request.set_id(id);
  return request;
}

class SceneIdApi : public ServedDaemon {
 protected:
  using ServedDaemon::ServedDaemon;

  grpc::Status Create(const v1::CreateSceneRequest& request) {
    return Call(*scenes, &SceneStub::CreateScene, request, created);
  }

  v1::Scene Get(const std::string& name) {
    return Called(*scenes, &SceneStub::GetScene, Named<v1::GetSceneRequest>(name)).scene();
  }

  grpc::Status Delete(const std::string& name) {
    return Call(*scenes, &SceneStub::DeleteScene, Named<v1::DeleteSceneRequest>(name));
  }

  v1::CreateSceneResponse created;
};

TEST_F(SceneIdApi, TheSameRequestAgainGivesTheSameSceneWithItsObjects) {
  v1::CreateSceneRequest request = Wanted("lathe-1");
  request.set_gain(0.5);
  request.mutable_hearing()->set_panning(true);
  ASSERT_TRUE(Create(request).ok());
  EXPECT_EQ(created.name(), "scenes/lathe-1");
  EXPECT_FALSE(created.existing());
  const auto added = Called(*scenes, &SceneStub::AddObjects, SmallObject(created.name()));
  EXPECT_EQ(added.objects(0).name(), "scenes/lathe-1/objects/1");
  auto louder = Named<v1::UpdateSceneRequest>(created.name());
  louder.set_gain(2);
  Called(*scenes, &SceneStub::UpdateScene, louder);
  // The same settings, written otherwise.
  request.mutable_hearing()->set_reference_distance_m(1);
  request.mutable_listener();
  ASSERT_TRUE(Create(request).ok());
  EXPECT_TRUE(created.existing());
  EXPECT_EQ(Called(*scenes, &SceneStub::ListScenes, {}).scenes_size(), 1);
  const v1::Scene scene = Get("scenes/lathe-1");
  EXPECT_EQ(scene.name(), "scenes/lathe-1");
  EXPECT_EQ(scene.object_count(), 1U);
  EXPECT_EQ(scene.gain(), 2);
  EXPECT_EQ(StrikeLive("scenes/lathe-1").accepted_count(), 1U);
}

TEST_F(SceneIdApi, OtherSettingsUnderTheSameIdAreRefusedUntilTheSceneIsDeleted) {
  ASSERT_TRUE(Create(Wanted("a")).ok());
  const std::vector<std::function<void(v1::CreateSceneRequest&)>> changes = {
      [](v1::CreateSceneRequest& request) { request.set_keep(true); },
      [](v1::CreateSceneRequest& request) { request.set_gain(0.5); },
      [](v1::CreateSceneRequest& request) { request.mutable_hearing()->set_panning(true); },
      [](v1::CreateSceneRequest& request) {
        request.mutable_listener()->mutable_position_m()->set_x(1);
      }};
  for (const auto& change : changes) {
    v1::CreateSceneRequest other = Wanted("a");
    change(other);
    ExpectRefused(Create(other), grpc::ALREADY_EXISTS, "SCENE_DIFFERS");
  }
  ASSERT_TRUE(Delete("scenes/a").ok());
  ExpectRefused(Delete("scenes/a"), grpc::NOT_FOUND, "SCENE_NOT_FOUND");
  v1::CreateSceneRequest kept = Wanted("a");
  kept.set_keep(true);
  ASSERT_TRUE(Create(kept).ok());
  EXPECT_FALSE(created.existing());
}

TEST_F(SceneIdApi, AnIdHasTheStatedForm) {
  for (const std::string& id :
       {std::string("a"), std::string("robot_2.left-hand"), std::string(64, 'z')}) {
    ASSERT_TRUE(Create(Wanted(id)).ok()) << id;
    EXPECT_EQ(created.name(), "scenes/" + id);
  }
  for (const std::string& id : {std::string("1"), std::string("-a"), std::string("A"),
                                std::string("a/b"), std::string("a b"), std::string("\xc3\xa4"),
                                std::string("a\0b", 3), std::string("a\n"), std::string(65, 'z')}) {
    ExpectRefused(Create(Wanted(id)), kInvalid, "INVALID_SETTINGS");
  }
}

class BriefSceneIdApi : public SceneIdApi {
 protected:
  BriefSceneIdApi() : SceneIdApi({.scene_grace_s = 0.2, .client_share = 1}) {}
};

TEST_F(BriefSceneIdApi, AnIdIsFreeAgainWhenItsSceneHasEndedWithItsClient) {
  auto channel = Connect(address_);
  Called(*v1::SceneService::NewStub(channel), &SceneStub::CreateScene, Wanted("brief"));
  channel.reset();
  // Looking does not make it last.
  const auto brief = Named<v1::GetSceneRequest>("scenes/brief");
  while (Call(*scenes, &SceneStub::GetScene, brief).ok()) {
  }
  // The daemon logs the end after it.
  while (!absl::StrContains(log(), "scenes/brief has ended: its clients have gone")) {
  }
  ASSERT_TRUE(Create(Wanted("brief")).ok());
  EXPECT_FALSE(created.existing());
}

class GuardedSceneIdApi : public SceneIdApi {
 protected:
  GuardedSceneIdApi()
      : SceneIdApi({.access_file = AccessFile(), .client_share = 1}, {"127.0.0.1:0"}) {}

  static std::string AccessFile() {
    std::string path = testing::TempDir() + "/carillon_scene_id_access";
    WriteBytes(path, "ann strike sha256:" + Sha256Hex("ann's") +
                         "\nboss strike,administer sha256:" + Sha256Hex("boss's") + "\n");
    std::filesystem::permissions(path, std::filesystem::perms(0600));
    return path;
  }

  grpc::Status CreateAs(const std::string& token, const std::string& id) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + token);
    const auto stub = v1::SceneService::NewStub(Connect(server_->addresses().back()));
    return stub->CreateScene(&context, Wanted(id), &created);
  }
};

TEST_F(GuardedSceneIdApi, TheIdOfAnotherOwnerIsRefusedAlsoToAnAdministrator) {
  ASSERT_TRUE(CreateAs("ann's", "mine").ok());
  ExpectRefused(CreateAs("boss's", "mine"), grpc::ALREADY_EXISTS, "SCENE_ID_TAKEN");
  ExpectRefused(Create(Wanted("mine")), grpc::ALREADY_EXISTS, "SCENE_ID_TAKEN");
  ASSERT_TRUE(CreateAs("ann's", "mine").ok());
  EXPECT_TRUE(created.existing());
}

class AddObjectsApi : public SceneIdApi {
 protected:
  v1::AddObjectsRequest Objects(const std::vector<uint32_t>& handles) {
    v1::AddObjectsRequest request;
    request.set_scene(scene_);
    const v1::NewObject object = SmallObject("").objects(0);
    for (const uint32_t handle : handles) {
      *request.add_objects() = object;
      request.mutable_objects()->rbegin()->set_handle(handle);
    }
    return request;
  }

  void ExpectRefusedAt(int index, const v1::AddObjectsRequest& request, grpc::StatusCode code,
                       const char* reason) {
    const grpc::Status status = Call(*scenes, &SceneStub::AddObjects, request);
    ExpectRefused(status, code, reason);
    EXPECT_EQ(ErrorOf(status).metadata().at("index"), absl::StrCat(index));
    EXPECT_THAT(ErrorOf(status).message(),
                testing::StartsWith(absl::StrCat("objects[", index, "]")));
    EXPECT_EQ(Get(scene_).object_count(), 0U) << reason;
  }

  const std::string scene_ = CreateScene();
};

TEST_F(AddObjectsApi, OneThatIsRefusedKeepsAllOthersOutAndIsNamed) {
  ExpectRefusedAt(3, Objects({1, 2, 3, 2}), grpc::ALREADY_EXISTS, "OBJECT_EXISTS");
  v1::AddObjectsRequest request = Objects({1, 2, 3});
  request.mutable_objects(2)->set_size(-1);
  ExpectRefusedAt(2, request, kInvalid, "INVALID_SETTINGS");
  request.mutable_objects(1)->set_modal_model("modalModels/none");
  ExpectRefusedAt(1, request, grpc::NOT_FOUND, "MODAL_MODEL_NOT_FOUND");
  request.mutable_objects(0)->mutable_material()->set_preset("unobtainium");
  ExpectRefusedAt(0, request, kInvalid, "UNKNOWN_MATERIAL");
  Called(*scenes, &SceneStub::AddObjects, Objects({1, 2}));
}

}  // namespace
}  // namespace carillon
