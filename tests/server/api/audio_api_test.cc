// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <thread>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class AudioApi : public ServedDaemon {
 protected:
  using ServedDaemon::ServedDaemon;
  using Requests = std::vector<v1::RenderRequest>;

  static v1::ContactTraceHeader& HeaderOf(Requests& requests) {
    return *requests[1].mutable_record()->mutable_header();
  }

  static v1::ContactStep& StepOf(Requests& requests) {
    return *requests[3].mutable_record()->mutable_step();
  }

  /// The rendering, which must succeed.
  Rendering Rendered(const Requests& requests) {
    Rendering rendering = Render(requests);
    EXPECT_TRUE(rendering.status.ok()) << rendering.status.error_message();
    return rendering;
  }

  /// The rendering of one object that is struck once along x.
  Rendering RenderStrike(double newton_seconds, double full_scale_pa = 0) {
    Requests requests = Trace();
    requests[0].mutable_settings()->set_tail_s(0.6);
    if (full_scale_pa != 0) requests[0].mutable_settings()->set_full_scale_pa(full_scale_pa);
    v1::ContactStep& step = StepOf(requests);
    step.set_time_s(0);
    step.mutable_contacts(0)->mutable_impulse_newton_seconds()->set_x(newton_seconds);
    return Render(requests);
  }
};

TEST_F(AudioApi, ATraceCarriesHowAndFromWhereItIsHeard) {
  Requests requests = Trace();
  requests[0].mutable_settings()->set_channel_count(2);
  v1::ContactTraceHeader& header = HeaderOf(requests);
  header.mutable_hearing()->set_propagation_delay(true);
  header.mutable_hearing()->set_panning(true);
  header.mutable_hearing()->set_sound_speed_m_per_s(480);
  header.mutable_listener()->mutable_position_m()->set_y(2);
  v1::ContactTraceObject& object = *requests[2].mutable_record()->mutable_object();
  object.mutable_pose()->mutable_position_m()->set_y(2);
  object.mutable_pose()->mutable_position_m()->set_x(4.8);  // 480 frames to the right
  const Rendering rendering = Rendered(requests);
  EXPECT_EQ(rendering.format.channel_count(), 2U);
  EXPECT_EQ(rendering.summary.frame_count(), rendering.sound.size() / 2);
  const auto heard = [](float x) { return std::abs(x) > 1e-6; };
  const auto onset = std::ranges::find_if(rendering.sound, heard) - rendering.sound.begin();
  EXPECT_EQ(onset % 2, 1);
  // sin(0) is silent; what lies between two samples rings a little before.
  const auto frame = onset / 2;
  EXPECT_NEAR(static_cast<double>(frame), 0.5 * 48000 + 480 + 1, 1);
}

TEST_F(AudioApi, PosesInTheStepsMoveTheObjectsOfATrace) {
  Requests requests = Trace();
  requests[0].mutable_settings()->set_channel_count(2);
  HeaderOf(requests).mutable_hearing()->set_panning(true);
  v1::PoseColumns& poses = *StepOf(requests).mutable_poses();
  for (const uint32_t object : {1U, 7U}) {  // there is no object 7
    poses.add_object(object);
    for (const double x : {-1, 0, 0}) poses.add_position_m(x);
  }
  const Rendering rendering = Rendered(requests);
  EXPECT_EQ(rendering.summary.rejected_count(), 1U);
  double left = 0, right = 0;
  for (size_t n = 0; n < rendering.sound.size(); n += 2) {
    left += std::abs(rendering.sound[n]);
    right += std::abs(rendering.sound[n + 1]);
  }
  EXPECT_GT(left, 1);
  EXPECT_LT(right, 1e-5 * left);
}

TEST_F(AudioApi, WhatIsNoTraceIsRefused) {
  const Requests good = Trace();
  Requests newer = good;
  HeaderOf(newer).set_format_version(2);
  Requests backwards = good;
  backwards.push_back(good[3]);
  backwards[4].mutable_record()->mutable_step()->set_time_s(0.05);
  for (const Requests& requests : {Requests(),
                                   {good[0]},
                                   {good[1], good[2]},           // no settings
                                   {good[0], good[0], good[1]},  // settings twice
                                   {good[0], good[2]},           // no header
                                   {good[0], good[1], good[1]},  // header twice
                                   {good[0], v1::RenderRequest()},
                                   newer,
                                   backwards}) {
    ExpectRefused(Render(requests).status, kInvalid, "TRACE_MALFORMED");
  }
}

TEST_F(AudioApi, ATraceThatWasHeardLiveBeginsAtItsFirstStep) {
  Requests heard = Trace();
  v1::ContactStep& step = StepOf(heard);
  step.mutable_contacts(0)->set_duration_s(0);
  v1::ContactTraceClock& clock = *HeaderOf(heard).mutable_clock();
  clock.set_first_frame(1280);
  clock.set_scheduling_delay_s(0.125);
  std::vector<float> sound;
  // A simulation may begin before zero, or send the seconds since 1970.
  for (const double first_time_s : {0.25, -1000.0, 1.75e9}) {
    clock.set_first_time_s(first_time_s);
    step.set_time_s(first_time_s + 0.25);
    const Rendering rendering = Rendered(heard);
    const auto onset = std::ranges::find_if(rendering.sound, [](float x) { return x != 0; });
    EXPECT_EQ(onset - rendering.sound.begin(), (0.25 + 0.125) * 48000 + 1);  // sin(0) is silent
    if (sound.empty()) sound = rendering.sound;
    EXPECT_EQ(rendering.sound, sound);
  }
}

TEST_F(AudioApi, ARenderingStatesItsLengthPressureAndLoudness) {
  const Rendering rendering = RenderStrike(1);
  EXPECT_EQ(rendering.format.sample_rate_hz(), 48000U);
  EXPECT_EQ(rendering.format.channel_count(), 1U);
  EXPECT_EQ(rendering.sound.size(), 0.6 * 48000);
  const v1::RenderSummary& once = rendering.summary;
  EXPECT_EQ(once.frame_count(), rendering.sound.size());
  EXPECT_EQ(once.accepted_count(), 1U);
  EXPECT_EQ(once.rejected_count(), 0U);
  EXPECT_GT(once.peak(), 0.0001);
  EXPECT_EQ(once.full_scale_pa(), 200);
  EXPECT_DOUBLE_EQ(once.peak_pa(), 200 * once.peak());
  EXPECT_GE(once.true_peak(), 0.99 * once.peak());
  ASSERT_TRUE(once.has_integrated_lufs() && once.has_loudest_momentary_lufs());
  EXPECT_GE(once.loudest_momentary_lufs(), once.integrated_lufs() - 0.1);
  // Half of the impulse is 6.02 dB less.
  const v1::RenderSummary half = RenderStrike(0.5).summary;
  EXPECT_NEAR(once.loudest_momentary_lufs() - half.loudest_momentary_lufs(), 6.02, 0.01);
  // The reference level scales the sound and leaves the pressure.
  const v1::RenderSummary louder = RenderStrike(1, 20).summary;
  EXPECT_EQ(louder.full_scale_pa(), 20);
  EXPECT_NEAR(louder.peak() / once.peak(), 10, 1e-4);
  EXPECT_NEAR(louder.peak_pa() / once.peak_pa(), 1, 1e-5);
  EXPECT_NEAR(louder.loudest_momentary_lufs() - once.loudest_momentary_lufs(), 20, 0.01);
  ExpectRefused(RenderStrike(0.1, -1).status, kInvalid, "INVALID_SETTINGS");
  // Next to nothing has no loudness.
  const v1::RenderSummary silent = RenderStrike(1e-9).summary;
  EXPECT_FALSE(silent.has_integrated_lufs() || silent.has_loudest_momentary_lufs());
}

TEST_F(AudioApi, TheMixerStatesTheLoudnessOfWhatItPlays) {
  const auto get_mixer = [this] { return Called(*audio, &AudioStub::GetMixer, {}); };
  v1::GetMixerResponse mixer = get_mixer();
  EXPECT_FALSE(mixer.has_momentary_lufs() || mixer.has_short_term_lufs());
  ASSERT_EQ(StrikeLive(CreateSceneWithObject()).accepted_count(), 1U);
  while (!mixer.has_momentary_lufs()) mixer = get_mixer();
  EXPECT_GT(mixer.momentary_lufs(), -70);
  EXPECT_EQ(mixer.full_scale_pa(), 200);
  EXPECT_DOUBLE_EQ(mixer.peak_pa(), 200 * mixer.peak());
  EXPECT_GT(mixer.peak_pa(), 0);
}

/// A daemon of whose memory for renderings one client has very little.
class LittleMemoryApi : public AudioApi {
 protected:
  LittleMemoryApi() : AudioApi({.client_share = 0.001}) {}
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
