// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class SceneApi : public ServedDaemon {
 protected:
  using Stream = grpc::ClientReaderWriter<v1::StreamContactsRequest, v1::StreamContactsResponse>;

  static v1::StreamContactsRequest Start(const std::string& scene) {
    v1::StreamContactsRequest request;
    request.mutable_start()->set_scene(scene);
    request.mutable_start()->set_step_s(0.01);
    return request;
  }

  /// Sends `requests`, then reads to the end; the last answer stays in `last`.
  grpc::Status Exchange(const std::vector<v1::StreamContactsRequest>& requests,
                        v1::StreamContactsResponse& last) {
    grpc::ClientContext context;
    const auto stream = contacts->StreamContacts(&context);
    for (const v1::StreamContactsRequest& request : requests) stream->Write(request);
    stream->WritesDone();
    while (stream->Read(&last)) {
    }
    return stream->Finish();
  }

  grpc::Status Update(const v1::UpdateObjectRequest& request, v1::UpdateObjectResponse& response) {
    grpc::ClientContext context;
    return scenes->UpdateObject(&context, request, &response);
  }
};

TEST_F(SceneApi, AnObjectStatesWhereItIsOnceItWasTold) {
  const std::string scene = CreateScene();
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(scene), added).ok());
  EXPECT_FALSE(added.objects(0).has_pose());
  v1::UpdateObjectRequest request;
  request.set_name(added.objects(0).name());
  request.mutable_pose()->mutable_position_m()->set_z(-3);
  v1::UpdateObjectResponse updated;
  ASSERT_TRUE(Update(request, updated).ok());
  EXPECT_EQ(updated.object().pose().position_m().z(), -3);
  EXPECT_EQ(updated.object().pose().orientation().w(), 1);
  request.set_glide_s(-1);
  ExpectRefused(Update(request, updated), grpc::INVALID_ARGUMENT, "INVALID_SETTINGS");
  v1::AddObjectsRequest nowhere = SmallObject(scene);
  nowhere.mutable_objects(0)->mutable_pose()->mutable_position_m()->set_x(1e7);
  ExpectRefused(Add(nowhere, added), grpc::INVALID_ARGUMENT, "INVALID_POSE");
}

TEST_F(SceneApi, TheListenerOfASceneCanBeMoved) {
  v1::UpdateListenerRequest request;
  request.set_scene(CreateScene());
  request.mutable_pose()->mutable_position_m()->set_x(1);
  const auto update = [&] {
    grpc::ClientContext context;
    v1::UpdateListenerResponse response;
    return scenes->UpdateListener(&context, request, &response);
  };
  EXPECT_TRUE(update().ok());
  request.mutable_pose()->mutable_orientation()->set_x(0.5);
  ExpectRefused(update(), grpc::INVALID_ARGUMENT, "INVALID_POSE");
  request.set_scene("scenes/99");
  ExpectRefused(update(), grpc::NOT_FOUND, "SCENE_NOT_FOUND");
}

TEST_F(SceneApi, AnObjectWithoutAMaterialGetsTheOneOfItsModel) {
  v1::AddObjectsRequest request = SmallObject(CreateScene());
  request.mutable_objects(0)->clear_material();
  v1::AddObjectsResponse response;
  ExpectRefused(Add(request, response), grpc::INVALID_ARGUMENT, "INVALID_MATERIAL");
  v1::UpdateModalModelRequest change;
  change.set_name(request.objects(0).modal_model());
  *change.mutable_material() = SmallMaterial();
  v1::UpdateModalModelResponse changed;
  ASSERT_TRUE(Call(*models, &v1::ModalModelService::Stub::UpdateModalModel, change, changed).ok());
  EXPECT_EQ(changed.modal_model().material().young_pa(), SmallMaterial().young_pa());
  ASSERT_TRUE(Add(request, response).ok());
  EXPECT_NEAR(response.objects(0).lowest_frequency_hz(), 440, 1e-9);
  change.mutable_material()->set_preset("cheese");
  ExpectRefused(Call(*models, &v1::ModalModelService::Stub::UpdateModalModel, change, changed),
                grpc::INVALID_ARGUMENT, "UNKNOWN_MATERIAL");
  request.mutable_objects(0)->set_modal_model("modalModels/" + std::string(64, '0'));
  ExpectRefused(Add(request, response), grpc::NOT_FOUND, "MODAL_MODEL_NOT_FOUND");
}

TEST_F(SceneApi, ContactsAreCountedAndTheLastRejectionSaysWhy) {
  const std::string scene = CreateScene();
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(scene), added).ok());
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
  ASSERT_TRUE(Exchange({Start(scene), request, columns, ragged}, last).ok());
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
  const std::string scene = CreateScene();
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(scene), added).ok());
  v1::StreamContactsRequest together;
  // More rows than gRPC's thread takes at once.
  for (int i = 0; i < 300; ++i) {
    v1::ContactStep& step = *together.add_steps();
    step.set_time_s(0.01 * i);
    *step.add_contacts() = Strike(1);
    if (i == 7) *step.add_contacts() = Strike(99);
  }
  v1::StreamContactsResponse last;
  ASSERT_TRUE(Exchange({Start(scene), together}, last).ok());
  EXPECT_EQ(last.step_count(), 300U);
  EXPECT_EQ(last.accepted_count() + last.late_count(), 300U);
  EXPECT_EQ(last.rejected_count(), 1U);
  EXPECT_THAT(last.last_rejection().message(), testing::HasSubstr("at 0.07 s"));
  together.mutable_steps(150)->set_time_s(0.3);
  const grpc::Status refused = Exchange({Start(scene), together}, last);
  ExpectRefused(refused, grpc::INVALID_ARGUMENT, "INVALID_STREAM");
  EXPECT_THAT(refused.error_message(), testing::HasSubstr("at step 150"));
  ExpectRefused(Exchange({together}, last), grpc::INVALID_ARGUMENT, "INVALID_STREAM");
}

TEST_F(SceneApi, TheFirstAnswerComesBeforeAnyStep) {
  const std::string scene = CreateScene();
  grpc::ClientContext context;
  const auto stream = contacts->StreamContacts(&context);
  stream->Write(Start(scene));
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
  {
    grpc::ClientContext context;
    const auto stream = contacts->StreamContacts(&context);
    stream->Write(Start(scene));
    v1::StreamContactsResponse answer;
    ASSERT_TRUE(stream->Read(&answer));
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::CANCELLED);
  }
  v1::StreamContactsResponse last;
  EXPECT_TRUE(Exchange({Start(scene)}, last).ok());
}

}  // namespace
}  // namespace carillon
