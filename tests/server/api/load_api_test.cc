// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

/// A daemon whose clients send as much as they can.
class LoadApi : public ServedDaemon {
 protected:
  explicit LoadApi(const ApiSettings& settings = {.client_share = 1}) : ServedDaemon(settings) {}
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

/// A daemon of whose memory for renderings one client has very little.
class LittleMemoryApi : public LoadApi {
 protected:
  LittleMemoryApi() : LoadApi({.client_share = 0.001}) {}
};

/// The events of this trace would take 200 MiB. A thread sends them, because the daemon reads on
/// only when the sound so far has been read.
TEST_F(LittleMemoryApi, ATraceOfAnyLengthIsRendered) {
  constexpr int kStepCount = 3000, kImpulseCount = 1000;
  grpc::ClientContext context;
  std::vector<v1::RenderRequest> trace = Trace();
  const auto stream = audio->Render(&context);
  std::jthread sender([&] {
    for (size_t i = 0; i < 3; ++i) stream->Write(trace[i]);
    v1::RenderRequest request;
    v1::ContactStep& step = *request.mutable_record()->mutable_step();
    v1::ContactColumns& columns = *step.add_contact_columns();
    columns.set_kind(v1::CONTACT_KIND_IMPACT);
    for (int i = 0; i < kImpulseCount; ++i) {
      columns.add_object(1);
      for (const float x : {0.0F, 0.0F, 0.0F}) columns.add_point_m(x);
      for (const float x : {1e-6F, 0.0F, 0.0F}) columns.add_impulse_newton_seconds(x);
      columns.add_duration_s(0);
      columns.add_time_offset_s(1e-5F * static_cast<float>(i));  // equal ones would be added up
    }
    for (int i = 0; i < kStepCount; ++i) {
      step.set_time_s(0.01 * i);
      stream->Write(request);
    }
    stream->WritesDone();
  });
  v1::RenderResponse response;
  uint64_t frame_count = 0;
  while (stream->Read(&response)) {
    if (!response.has_block()) continue;
    EXPECT_EQ(response.block().first_frame(), frame_count);
    frame_count += response.block().samples().size() / sizeof(float);
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(response.summary().accepted_count(), uint64_t{kStepCount} * kImpulseCount);
  EXPECT_EQ(response.summary().rejected_count(), 0U);
  EXPECT_EQ(response.summary().frame_count(), frame_count);
}

}  // namespace
}  // namespace carillon
