// SPDX-License-Identifier: Apache-2.0
#include <functional>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/base/sha256.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using SceneApi = ServedDaemon;

TEST_F(SceneApi, AnObjectStatesWhereItIsOnceItWasTold) {
  v1::AddObjectsRequest one = SmallObject(CreateScene());
  const auto added = Called(*scenes, &SceneStub::AddObjects, one).objects(0);
  EXPECT_FALSE(added.has_pose());
  auto request = Named<v1::UpdateObjectRequest>(added.name());
  request.mutable_pose()->mutable_position_m()->set_z(-3);
  const v1::Pose pose = Called(*scenes, &SceneStub::UpdateObject, request).object().pose();
  EXPECT_EQ(pose.position_m().z(), -3);
  EXPECT_EQ(pose.orientation().w(), 1);
  request.set_glide_s(-1);
  ExpectRefused(Call(*scenes, &SceneStub::UpdateObject, request), kInvalid, "INVALID_SETTINGS");
  one.mutable_objects(0)->mutable_pose()->mutable_position_m()->set_x(1e7);
  ExpectRefused(Call(*scenes, &SceneStub::AddObjects, one), kInvalid, "INVALID_POSE");
}

TEST_F(SceneApi, TheListenerOfASceneCanBeMoved) {
  v1::UpdateListenerRequest request;
  request.set_scene(CreateScene());
  request.mutable_pose()->mutable_position_m()->set_x(1);
  const auto update = [&] { return Call(*scenes, &SceneStub::UpdateListener, request); };
  EXPECT_TRUE(update().ok());
  request.mutable_pose()->mutable_orientation()->set_x(0.5);
  ExpectRefused(update(), kInvalid, "INVALID_POSE");
  request.set_scene("scenes/99");
  ExpectRefused(update(), grpc::NOT_FOUND, "SCENE_NOT_FOUND");
}

TEST_F(SceneApi, AnObjectWithoutAMaterialGetsTheOneOfItsModel) {
  v1::AddObjectsRequest request = SmallObject(CreateScene());
  request.mutable_objects(0)->clear_material();
  const auto add = [&] { return Call(*scenes, &SceneStub::AddObjects, request); };
  ExpectRefused(add(), kInvalid, "INVALID_MATERIAL");
  auto change = Named<v1::UpdateModalModelRequest>(request.objects(0).modal_model());
  *change.mutable_material() = SmallMaterial();
  EXPECT_EQ(
      Called(*models, &ModelStub::UpdateModalModel, change).modal_model().material().young_pa(),
      SmallMaterial().young_pa());
  const v1::AddObjectsResponse added = Called(*scenes, &SceneStub::AddObjects, request);
  EXPECT_NEAR(added.objects(0).lowest_frequency_hz(), 440, 1e-9);
  change.mutable_material()->set_preset("cheese");
  ExpectRefused(Call(*models, &ModelStub::UpdateModalModel, change), kInvalid, "UNKNOWN_MATERIAL");
  request.mutable_objects(0)->set_modal_model("modalModels/" + std::string(64, '0'));
  ExpectRefused(add(), grpc::NOT_FOUND, "MODAL_MODEL_NOT_FOUND");
}

TEST_F(SceneApi, ContactsAreCountedAndTheLastRejectionSaysWhy) {
  const std::string scene = CreateSceneWithObject();
  v1::StreamContactsRequest request;
  v1::ContactStep& step = *request.add_steps();
  *step.add_contacts() = Strike(1);
  *step.add_contacts() = Strike(99);
  step.add_contacts()->set_object(1);  // no location
  v1::StreamContactsRequest columns;
  v1::ContactColumns& column = *columns.add_steps()->add_contact_columns();
  column.set_kind(v1::CONTACT_KIND_IMPACT);
  for (int i = 0; i < 2; ++i) {
    column.add_object(1);
    for (const float x : {0.0F, 0.0F, 0.0F}) column.add_point_m(x);
    for (const float x : {1.0F, 0.0F, 0.0F}) column.add_impulse_newton_seconds(x);
  }
  v1::StreamContactsRequest ragged = columns;
  ragged.mutable_steps(0)->mutable_contact_columns(0)->add_point_m(0);
  v1::StreamContactsResponse last;
  ASSERT_TRUE(Exchange({StreamStart(scene), request, columns, ragged}, last).ok());
  EXPECT_EQ(last.step_count(), 3U);
  // Whether a block was rendered in between is the machine's affair; nothing may be lost.
  EXPECT_EQ(last.accepted_count() + last.late_count(), 3U);
  EXPECT_EQ(last.dropped_count(), 0U);
  EXPECT_EQ(last.rejected_count(), 4U);
  EXPECT_EQ(last.last_rejection().reason(), "CONTACT_MALFORMED");
  EXPECT_DOUBLE_EQ(last.scheduling_delay_s(), 0.01 + 128 / 48000.0 + 0.005);
  EXPECT_DOUBLE_EQ(last.output_latency_s(), 8 * 128 / 48000.0);  // the null device adds none
}

TEST_F(SceneApi, StepsOfOneMessageAreTakenAsIfEachCameAlone) {
  const std::string scene = CreateSceneWithObject();
  v1::StreamContactsRequest together;
  // More rows than gRPC's thread takes at once.
  for (int i = 0; i < 300; ++i) {
    v1::ContactStep& step = *together.add_steps();
    step.set_time_s(0.01 * i);
    *step.add_contacts() = Strike(1);
    if (i == 7) *step.add_contacts() = Strike(99);
  }
  v1::StreamContactsResponse last;
  ASSERT_TRUE(Exchange({StreamStart(scene), together}, last).ok());
  EXPECT_EQ(last.step_count(), 300U);
  EXPECT_EQ(last.accepted_count() + last.late_count(), 300U);
  EXPECT_EQ(last.rejected_count(), 1U);
  EXPECT_THAT(last.last_rejection().message(), testing::HasSubstr("at 0.07 s"));
  together.mutable_steps(150)->set_time_s(0.3);
  const grpc::Status refused = Exchange({StreamStart(scene), together}, last);
  ExpectRefused(refused, kInvalid, "INVALID_STREAM");
  EXPECT_THAT(refused.error_message(), testing::HasSubstr("at step 150"));
  ExpectRefused(Exchange({together}, last), kInvalid, "INVALID_STREAM");
}

TEST_F(SceneApi, LargeStepsAreTakenWholeAndInOrder) {
  std::vector<v1::StreamContactsRequest> requests = {StreamStart(CreateSceneWithObject())};
  for (int i = 0; i < 20; ++i) {  // times that went back would end the stream
    v1::ContactStep& step = *requests.emplace_back().add_steps();
    step.set_time_s(i * 0.01);
    const int count = i % 2 == 0 ? 5000 : 1;
    for (int j = 0; j < count; ++j) *step.add_contacts() = Strike(2);
  }
  v1::StreamContactsResponse last;
  EXPECT_TRUE(Exchange(requests, last).ok());
  EXPECT_EQ(last.step_count(), 20U);
  EXPECT_EQ(last.rejected_count(), 10U * 5001);
}

TEST_F(SceneApi, TheFirstAnswerComesBeforeAnyStep) {
  grpc::ClientContext context;
  const auto stream = contacts->StreamContacts(&context);
  stream->Write(StreamStart(CreateScene()));
  v1::StreamContactsResponse answer;
  ASSERT_TRUE(stream->Read(&answer));
  EXPECT_EQ(answer.step_count(), 0U);
  EXPECT_GT(answer.scheduling_delay_s(), 0);
  stream->WritesDone();
  EXPECT_TRUE(stream->Read(&answer));  // once at the end
  EXPECT_FALSE(stream->Read(&answer));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(SceneApi, ASceneOutlivesAStreamThatWasCutOff) {
  const std::string scene = CreateScene();
  v1::StreamContactsResponse answer;
  {
    grpc::ClientContext context;
    const auto stream = contacts->StreamContacts(&context);
    stream->Write(StreamStart(scene));
    ASSERT_TRUE(stream->Read(&answer));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
  }
  EXPECT_TRUE(Exchange({StreamStart(scene)}, answer).ok());
}

// Scenes with ids of the client's choice, and many objects in one call.

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
