// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/api/edge/listen_address.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

/// Everything from the first sample that is not silent.
std::vector<float> FromOnset(const std::vector<float>& sound) {
  return {std::ranges::find_if(sound, [](float x) { return x != 0; }), sound.end()};
}

class AudioApi : public ServedDaemon {
 protected:
  using Requests = std::vector<v1::RenderRequest>;
};

TEST_F(AudioApi, RenderGivesFormatSoundAndSummary) {
  const Rendering rendering = Render(Trace());
  ASSERT_TRUE(rendering.status.ok()) << rendering.status.error_message();
  EXPECT_EQ(rendering.format.sample_rate_hz(), 48000U);
  EXPECT_EQ(rendering.format.channel_count(), 1U);
  EXPECT_EQ(rendering.sound.size(), 0.7 * 48000);
  EXPECT_EQ(rendering.summary.frame_count(), rendering.sound.size());
  EXPECT_EQ(rendering.summary.accepted_count(), 1U);
  EXPECT_EQ(rendering.summary.rejected_count(), 0U);
  EXPECT_GT(rendering.summary.peak(), 0.0001);
}

TEST_F(AudioApi, ATraceCarriesHowAndFromWhereItIsHeard) {
  Requests requests = Trace();
  requests[0].mutable_settings()->set_channel_count(2);
  v1::ContactTraceHeader& header = *requests[1].mutable_record()->mutable_header();
  header.mutable_hearing()->set_propagation_delay(true);
  header.mutable_hearing()->set_panning(true);
  header.mutable_hearing()->set_sound_speed_m_per_s(480);
  header.mutable_listener()->mutable_position_m()->set_y(2);
  v1::ContactTraceObject& object = *requests[2].mutable_record()->mutable_object();
  object.mutable_pose()->mutable_position_m()->set_y(2);
  object.mutable_pose()->mutable_position_m()->set_x(4.8);  // 480 frames to the right
  const Rendering rendering = Render(requests);
  ASSERT_TRUE(rendering.status.ok()) << rendering.status.error_message();
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
  requests[1].mutable_record()->mutable_header()->mutable_hearing()->set_panning(true);
  v1::ContactStep& step = *requests[3].mutable_record()->mutable_step();
  for (const uint32_t object : {1U, 7U}) {  // there is no object 7
    step.mutable_poses()->add_object(object);
    for (const double x : {-1, 0, 0}) step.mutable_poses()->add_position_m(x);
  }
  const Rendering rendering = Render(requests);
  ASSERT_TRUE(rendering.status.ok()) << rendering.status.error_message();
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
  const auto expect = [&](const Requests& requests) {
    ExpectRefused(Render(requests).status, grpc::INVALID_ARGUMENT, "TRACE_MALFORMED");
  };
  expect({});
  expect({good[0]});
  expect({good[1], good[2]});           // no settings
  expect({good[0], good[0], good[1]});  // settings twice
  expect({good[0], good[2]});           // no header
  expect({good[0], good[1], good[1]});  // header twice
  expect({good[0], v1::RenderRequest()});
  Requests newer = good;
  newer[1].mutable_record()->mutable_header()->set_format_version(2);
  expect(newer);
  Requests backwards = good;
  backwards.push_back(good[3]);
  backwards[4].mutable_record()->mutable_step()->set_time_s(0.05);
  expect(backwards);
}

TEST_F(AudioApi, ATraceThatWasHeardLiveBeginsAtItsFirstStep) {
  Requests heard = Trace();
  v1::ContactStep& step = *heard[3].mutable_record()->mutable_step();
  step.mutable_contacts(0)->set_duration_s(0);
  v1::ContactTraceClock& clock = *heard[1].mutable_record()->mutable_header()->mutable_clock();
  clock.set_first_frame(1280);
  clock.set_scheduling_delay_s(0.125);
  std::vector<float> sound;
  // A simulation may begin before zero, or send the seconds since 1970.
  for (const double first_time_s : {0.25, -1000.0, 1.75e9}) {
    clock.set_first_time_s(first_time_s);
    step.set_time_s(first_time_s + 0.25);
    const Rendering rendering = Render(heard);
    ASSERT_TRUE(rendering.status.ok()) << rendering.status.error_message();
    const size_t silent = rendering.sound.size() - FromOnset(rendering.sound).size();
    EXPECT_EQ(silent, (0.25 + 0.125) * 48000 + 1);  // sin(0) is silent
    if (sound.empty()) sound = rendering.sound;
    EXPECT_EQ(rendering.sound, sound);
  }
}

TEST_F(AudioApi, ASecondDaemonOnTheSameSocketIsRefused) {
  EXPECT_THAT(PrepareSocket(address().substr(5)).status().ToString(),
              testing::HasSubstr("LISTEN_FAILED: "));
}

}  // namespace
}  // namespace carillon
