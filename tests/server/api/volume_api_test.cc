// SPDX-License-Identifier: Apache-2.0
// The volume of scenes and of the output, stops, stems and recorded contacts, as clients see them.
#include <algorithm>

#include "server/api/services/trace_recorders.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class VolumeApi : public ServedDaemon {
 protected:
  /// The records of the stream that `act` sends to a scene.
  template <class Act>
  std::vector<v1::ContactTraceRecord> Recorded(const std::string& scene, Act act) {
    grpc::ClientContext context;
    v1::RecordContactsRequest request;
    request.set_scene(scene);
    const auto reader = contacts->RecordContacts(&context, request);
    v1::RecordContactsResponse response;
    EXPECT_TRUE(reader->Read(&response));
    EXPECT_FALSE(response.has_record());
    act();
    std::vector<v1::ContactTraceRecord> records;
    while (reader->Read(&response)) records.push_back(response.record());
    EXPECT_TRUE(reader->Finish().ok());
    return records;
  }

  /// The samples of an offline rendering of the records.
  std::vector<float> RenderRecords(const std::vector<v1::ContactTraceRecord>& records,
                                   double gain) {
    std::vector<v1::RenderRequest> requests(1);
    requests[0].mutable_settings()->set_gain(gain);
    requests[0].mutable_settings()->set_tail_s(0.5);
    for (const v1::ContactTraceRecord& record : records) {
      *requests.emplace_back().mutable_record() = record;
    }
    Rendering rendering = Render(requests);
    EXPECT_TRUE(rendering.status.ok());
    return rendering.sound;
  }

  /// Expects that the stream that `act` sends to a scene renders to the samples that are heard, and
  /// returns its records.
  template <class Act>
  std::vector<v1::ContactTraceRecord> ExpectRendersAsHeard(const std::string& scene, Act act) {
    grpc::ClientContext listening;
    v1::ListenRequest listen;
    listen.set_scene(scene);
    const auto heard = audio->Listen(&listening, listen);
    v1::ListenResponse block;
    EXPECT_TRUE(heard->Read(&block));
    std::vector<v1::ContactTraceRecord> records = Recorded(scene, act);
    EXPECT_EQ(records.size(), 3U);
    const uint64_t first_frame = records[0].header().clock().first_frame();
    std::vector<float> rendered = RenderRecords(records, 1);
    rendered.resize(rendered.size() - 480);  // which fade out
    std::vector<float> live;
    while (live.size() < rendered.size() && heard->Read(&block)) {
      EXPECT_EQ(block.lost_frame_count(), 0U);
      if (block.block().first_frame() >= first_frame) AppendSamples(block.block(), live);
    }
    listening.TryCancel();
    live.resize(rendered.size());
    EXPECT_GT(*std::ranges::max_element(rendered), 1e-4F);
    EXPECT_EQ(live, rendered);
    return records;
  }
};

TEST_F(VolumeApi, AStemIsTheSceneAloneAndItsRecordedContactsRenderToTheSameSamples) {
  const std::string other = CreateSceneWithObject(), scene = CreateSceneWithObject();
  auto change = Named<v1::UpdateSceneRequest>(scene);
  change.set_gain(0.5);
  Called(*scenes, &SceneStub::UpdateScene, change);
  const std::vector<v1::ContactTraceRecord> records = ExpectRendersAsHeard(scene, [&] {
    StrikeLive(other);
    StrikeLive(scene);
  });
  EXPECT_EQ(records[0].header().gain(), 0.5);

  // A gain of the rendering is that much more.
  const std::vector<float> rendered = RenderRecords(records, 1);
  const std::vector<float> half = RenderRecords(records, 0.5);
  ASSERT_EQ(half.size(), rendered.size());
  for (size_t n = 0; n < half.size(); ++n) ASSERT_FLOAT_EQ(half[n], 0.5F * rendered[n]);
}

TEST_F(VolumeApi, AfterAStopASceneSoundsBitForBitAsOneThatNeverSounded) {
  const std::string scene = CreateSceneWithObject();
  EXPECT_EQ(StrikeLive(scene).accepted_count(), 1U);
  const auto ringing = [this] {
    return Called(*audio, &AudioStub::GetMixer, {}).active_mode_count() > 0;
  };
  while (!ringing()) {
  }
  Called(*scenes, &SceneStub::StopAll, {});
  while (ringing()) {  // which only the stop ends before the test's time is over
  }
  ExpectRendersAsHeard(scene, [&] { StrikeLive(scene); });
}

TEST_F(VolumeApi, BlocksHaveTheSizeAndTheEncodingAskedFor) {
  grpc::ClientContext context;
  v1::ListenRequest request;
  request.set_block_frame_count(1000);
  request.set_encoding(v1::AUDIO_ENCODING_INT16);
  const auto reader = audio->Listen(&context, request);
  v1::ListenResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.format().encoding(), v1::AUDIO_ENCODING_INT16);
  uint64_t next = 0;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.block().samples().size(), 2000U);
    if (i > 0) {
      EXPECT_EQ(response.block().first_frame(), next);
    }
    next = response.block().first_frame() + 1000;
  }
  context.TryCancel();
  grpc::ClientContext refused;
  request.set_block_frame_count(65537);
  ExpectRefused(audio->Listen(&refused, request)->Finish(), kInvalid, "INVALID_SETTINGS");
}

TEST_F(VolumeApi, AWatcherSeesEachBlowAndTheReportsOfTheStreamsOfItsScene) {
  const std::string scene = CreateSceneWithObject(), other = CreateSceneWithObject();
  grpc::ClientContext context;
  v1::WatchContactsRequest request;
  request.set_scene(scene);
  const auto reader = contacts->WatchContacts(&context, request);
  v1::WatchContactsResponse news;
  ASSERT_TRUE(reader->Read(&news));
  EXPECT_EQ(news.stream(), 0U);
  StrikeLive(other);
  const v1::StreamContactsResponse last = StrikeLive(scene, 0.25);
  EXPECT_EQ(last.accepted_count(), 1U);
  std::vector<v1::Blow> blows;
  v1::StreamContactsResponse report;
  while (!news.ended()) {
    ASSERT_TRUE(reader->Read(&news));
    EXPECT_EQ(news.stream(), 2U);  // the second stream of the daemon
    blows.insert(blows.end(), news.blows().begin(), news.blows().end());
    if (news.has_report()) report = news.report();
  }
  EXPECT_EQ(report.SerializeAsString(), last.SerializeAsString());
  ASSERT_EQ(blows.size(), 1U);
  EXPECT_EQ(blows[0].object(), 1U);
  const v1::Vec3 struck = Strike(1).impulse_newton_seconds();
  EXPECT_NEAR(blows[0].impulse_newton_seconds().x(), struck.x(), 1e-6);
  EXPECT_NEAR(blows[0].impulse_newton_seconds().y(), struck.y(), 1e-6);
  EXPECT_NEAR(blows[0].impulse_newton_seconds().z(), struck.z(), 1e-6);
  // Its time is that of the frames of the output.
  const double rate_hz = output_->format().sample_rate_hz;
  EXPECT_NEAR(blows[0].time_s(), static_cast<double>(last.first_frame()) / rate_hz + 0.25, 1e-6);
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::CANCELLED);
  grpc::ClientContext missing;
  request.set_scene("scenes/99");
  ExpectRefused(contacts->WatchContacts(&missing, request)->Finish(), grpc::NOT_FOUND,
                "SCENE_NOT_FOUND");
}

std::shared_ptr<const v1::ContactTraceRecord> AnyRecord() {
  return std::make_shared<const v1::ContactTraceRecord>();
}

TEST(TraceRecorder, TheBytesThatWaitAreBoundedAndFreedWhenTheyAreTooMany) {
  TraceRecorder recorder(1, [] {});
  const auto record = AnyRecord();
  constexpr size_t kQuarter = TraceRecorder::kMostWaitingBytes / 4;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(recorder.Add(record, kQuarter));
  EXPECT_FALSE(recorder.overflowed());
  EXPECT_FALSE(recorder.Add(record, 1));
  EXPECT_TRUE(recorder.overflowed());
  EXPECT_EQ(record.use_count(), 1);
  v1::ContactTraceRecord taken;
  EXPECT_FALSE(recorder.TryTake(taken));
}

TEST(TraceRecorder, ARecordThatWasTakenNoLongerCounts) {
  TraceRecorder recorder(1, [] {});
  v1::ContactTraceRecord taken;
  for (int i = 0; i < 8; ++i) {
    EXPECT_TRUE(recorder.Add(AnyRecord(), TraceRecorder::kMostWaitingBytes));
    EXPECT_TRUE(recorder.TryTake(taken));
  }
  EXPECT_FALSE(recorder.overflowed());
}

TEST(TraceRecorder, KeepsNothingForAClientThatHasGone) {
  TraceRecorder recorder(1, [] {});
  const auto record = AnyRecord();
  EXPECT_TRUE(recorder.Add(record, 1));
  recorder.Leave();
  EXPECT_FALSE(recorder.Add(record, 1));
  EXPECT_EQ(record.use_count(), 1);
}

}  // namespace
}  // namespace carillon
