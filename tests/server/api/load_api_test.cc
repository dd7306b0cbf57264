// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <memory>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

/// A daemon whose clients send as much as they can.
class LoadApi : public ServedDaemon {
 protected:
  explicit LoadApi(const ApiSettings& settings = {.client_share = 1}) : ServedDaemon(settings) {}

  /// Begins to render a trace, whose objects come next.
  std::unique_ptr<grpc::ClientReaderWriter<v1::RenderRequest, v1::RenderResponse>> BeginTrace(
      grpc::ClientContext& context) {
    auto stream = audio->Render(&context);
    v1::RenderRequest request;
    request.mutable_settings()->set_tail_s(0.2);
    stream->Write(request);
    request.mutable_record()->mutable_header()->set_format_version(1);
    stream->Write(request);
    return stream;
  }
};

TEST_F(LoadApi, LargeStepsAreTakenWholeAndInOrder) {
  v1::AddObjectsRequest object = SmallObject(CreateScene());
  object.mutable_objects(0)->set_handle(1);
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(object, added).ok());
  grpc::ClientContext context;
  const auto stream = contacts->StreamContacts(&context);
  v1::StreamContactsRequest request;
  request.mutable_start()->set_scene(object.scene());
  request.mutable_start()->set_step_s(0.01);
  stream->Write(request);
  for (int i = 0; i < 20; ++i) {  // times that went back would end the stream
    request.Clear();
    v1::ContactStep& step = *request.add_steps();
    step.set_time_s(i * 0.01);
    const int count = i % 2 == 0 ? 5000 : 1;
    for (int j = 0; j < count; ++j) *step.add_contacts() = Strike(2);
    stream->Write(request);
  }
  stream->WritesDone();
  v1::StreamContactsResponse answer;
  while (stream->Read(&answer)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(answer.step_count(), 20U);
  EXPECT_EQ(answer.rejected_count(), 10U * 5001);
}

TEST_F(LoadApi, ATraceWithMoreObjectsThanADaemonMaySoundIsRefused) {
  grpc::ClientContext context;
  const auto stream = BeginTrace(context);
  v1::RenderRequest request;
  v1::ContactTraceObject& object = *request.mutable_record()->mutable_object();
  object.set_modal_model(ImportSmallModel());
  *object.mutable_material() = SmallMaterial();
  for (uint32_t handle = 1; handle <= SceneRegistry::kMaxObjectCount + 1; ++handle) {
    object.set_handle(handle);
    if (!stream->Write(request)) break;
  }
  v1::RenderResponse response;
  EXPECT_FALSE(stream->Read(&response));
  ExpectRefused(stream->Finish(), grpc::RESOURCE_EXHAUSTED, "TRACE_TOO_LARGE");
}

/// A daemon of whose memory for renderings one client has very little.
class LittleMemoryApi : public LoadApi {
 protected:
  LittleMemoryApi() : LoadApi({.client_share = 0.001}) {}
};

TEST_F(LittleMemoryApi, ATraceThatTakesMoreThanTheClientsShareIsRefused) {
  grpc::ClientContext context;
  const auto stream = BeginTrace(context);
  v1::RenderRequest request;
  v1::ContactTraceObject& object = *request.mutable_record()->mutable_object();
  object.set_handle(1);
  object.set_modal_model(ImportSmallModel());
  *object.mutable_material() = SmallMaterial();
  stream->Write(request);
  for (int step = 0; step < 100; ++step) {
    v1::ContactStep& message = *request.mutable_record()->mutable_step();
    message.set_time_s(step);
    message.clear_contacts();
    for (int i = 0; i < 1000; ++i) {
      *message.add_contacts() = Strike(1);
      message.mutable_contacts(i)->set_time_offset_s(1e-3 * i);  // equal ones would be added up
    }
    if (!stream->Write(request)) break;
  }
  v1::RenderResponse response;
  EXPECT_FALSE(stream->Read(&response));
  ExpectRefused(stream->Finish(), grpc::RESOURCE_EXHAUSTED, "TRACE_TOO_LARGE");
  while (server().clients().renderings > 0) {
  }
}

}  // namespace
}  // namespace carillon
