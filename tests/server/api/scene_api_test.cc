// SPDX-License-Identifier: Apache-2.0
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

}  // namespace
}  // namespace carillon
