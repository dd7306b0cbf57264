// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "server/api/edge/listen_address.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

void AppendSamples(const v1::AudioBlock& block, std::vector<float>& sound) {
  const size_t old_size = sound.size();
  sound.resize(old_size + block.samples().size() / sizeof(float));
  std::memcpy(sound.data() + old_size, block.samples().data(), block.samples().size());
}

/// Everything from the first sample that is not silent.
std::vector<float> FromOnset(const std::vector<float>& sound) {
  return {std::ranges::find_if(sound, [](float x) { return x != 0; }), sound.end()};
}

class AudioApi : public ServedDaemon {
 protected:
  using Requests = std::vector<v1::RenderRequest>;

  struct Rendering {
    grpc::Status status;
    v1::AudioFormat format;
    std::vector<float> sound;
    v1::RenderSummary summary;
  };

  /// A trace of one object that is struck at 0.5 s.
  Requests Trace() {
    Requests requests(4);
    requests[0].mutable_settings()->set_tail_s(0.2);
    requests[1].mutable_record()->mutable_header()->set_format_version(1);
    v1::ContactTraceObject& object = *requests[2].mutable_record()->mutable_object();
    object.set_handle(1);
    object.set_modal_model(ImportSmallModel());
    *object.mutable_material() = SmallMaterial();
    v1::ContactStep& step = *requests[3].mutable_record()->mutable_step();
    step.set_time_s(0.5);
    *step.add_contacts() = Strike(1);
    return requests;
  }

  Rendering Render(const Requests& requests) {
    Rendering rendering;
    grpc::ClientContext context;
    const auto stream = audio->Render(&context);
    for (const v1::RenderRequest& request : requests) stream->Write(request);
    stream->WritesDone();
    v1::RenderResponse response;
    while (stream->Read(&response)) {
      if (response.has_format()) rendering.format = response.format();
      if (response.has_summary()) rendering.summary = response.summary();
      if (response.has_block()) {
        EXPECT_EQ(response.block().first_frame(),
                  rendering.sound.size() / rendering.format.channel_count());
        AppendSamples(response.block(), rendering.sound);
      }
    }
    rendering.status = stream->Finish();
    return rendering;
  }

  /// Listens while `act` happens, until a second has been heard after the first sound.
  std::vector<float> Hear(const std::function<void()>& act) {
    grpc::ClientContext context;
    const auto reader = audio->Listen(&context, {});
    v1::ListenResponse response;
    EXPECT_TRUE(reader->Read(&response));
    EXPECT_EQ(response.format().sample_rate_hz(), 48000U);
    EXPECT_EQ(response.format().channel_count(), 1U);
    act();
    std::vector<float> sound;
    uint64_t next_frame = 0;
    while (FromOnset(sound).size() < 9600 && reader->Read(&response)) {
      if (!sound.empty()) {
        EXPECT_EQ(response.block().first_frame(), next_frame);
      }
      AppendSamples(response.block(), sound);
      next_frame = response.block().first_frame() + response.block().samples().size() / 4;
    }
    EXPECT_EQ(response.lost_frame_count(), 0U);
    context.TryCancel();
    return sound;
  }
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

/// The same as columns; what they carry must be told by points.
void TurnIntoColumns(v1::ContactStep& step) {
  v1::ContactColumns& columns = *step.add_contact_columns();
  columns.set_kind(v1::CONTACT_KIND_IMPACT);
  const auto add = [](const v1::Vec3& vector, auto* column) {
    for (const double x : {vector.x(), vector.y(), vector.z()}) column->Add(static_cast<float>(x));
  };
  const auto turn = [](const v1::Quaternion& q, auto* column) {
    for (const double x : {q.w(), q.x(), q.y(), q.z()}) column->Add(static_cast<float>(x));
  };
  for (const v1::Contact& row : step.contacts()) {
    columns.add_object(row.object());
    add(row.point_m(), columns.mutable_point_m());
    add(row.impulse_newton_seconds(), columns.mutable_impulse_newton_seconds());
    columns.add_duration_s(static_cast<float>(row.duration_s()));
    columns.add_time_offset_s(static_cast<float>(row.time_offset_s()));
    columns.add_second_object(row.second().object());
    add(row.second().point_m(), columns.mutable_second_point_m());
    turn(row.second().rotation(), columns.mutable_second_rotation());
  }
  step.clear_contacts();
}

/// Twenty contacts of two objects that move and turn, some of the first alone; all figures are
/// such as single precision holds.
std::vector<v1::ContactStep> ContactsOfTwo(const v1::Contact& strike) {
  std::vector<v1::ContactStep> steps(20);
  for (int i = 0; i < 20; ++i) {
    v1::ContactStep& step = steps[i];
    step.set_time_s(0.5 + i / 64.0);
    for (const uint32_t object : {1U, 2U}) {
      v1::PoseColumns& poses = *step.mutable_poses();
      poses.add_object(object);
      for (const double x : {(object == 1 ? -1 : 1) * (i + 1) / 16.0, 0.0, 0.0}) {
        poses.add_position_m(x);
      }
      const bool turned = i % 2 == 1;
      const float w = object == 1 ? 0.6F : 0.8F, z = object == 1 ? 0.8F : 0.6F;
      for (const float x : {turned ? w : 0.0F, 0.0F, 0.0F, turned ? z : 0.0F}) {
        poses.add_orientation(x);
      }
    }
    v1::Contact& impulse = *step.add_contacts() = strike;
    impulse.set_duration_s((i % 3) / 1024.0);
    impulse.set_time_offset_s(i / 4096.0);
    if (i % 5 == 4) continue;  // alone
    impulse.mutable_second()->set_object(2);
    impulse.mutable_second()->mutable_point_m()->set_y(0.0625);
    if (i % 5 == 3) continue;  // turned as the poses say
    impulse.mutable_second()->mutable_rotation()->set_w(0.6F);
    impulse.mutable_second()->mutable_rotation()->set_z(0.8F);
  }
  return steps;
}

TEST_F(AudioApi, ColumnsSoundBitForBitAsTheSameInRows) {
  Requests rows = Trace();
  rows[0].mutable_settings()->set_channel_count(2);
  rows[1].mutable_record()->mutable_header()->mutable_hearing()->set_panning(true);
  rows.insert(rows.begin() + 3, rows[2]);
  rows[3].mutable_record()->mutable_object()->set_handle(2);
  rows[3].mutable_record()->mutable_object()->set_size(0.8);  // sounds higher than the first
  rows.resize(4);
  Requests columns = rows, alone = rows;
  for (v1::ContactStep& step : ContactsOfTwo(Strike(1))) {
    *rows.emplace_back().mutable_record()->mutable_step() = step;
    TurnIntoColumns(step);
    *columns.emplace_back().mutable_record()->mutable_step() = step;
    step.mutable_contact_columns(0)->clear_second_object();
    step.mutable_contact_columns(0)->clear_second_point_m();
    step.mutable_contact_columns(0)->clear_second_rotation();
    *alone.emplace_back().mutable_record()->mutable_step() = step;
  }
  const Rendering by_rows = Render(rows);
  const Rendering by_columns = Render(columns);
  EXPECT_EQ(by_rows.summary.rejected_count(), 0U);
  EXPECT_EQ(by_rows.summary.accepted_count(), 20U + 16);  // four are of one object
  EXPECT_EQ(by_columns.summary.accepted_count(), 20U + 16);
  EXPECT_GT(by_rows.summary.peak(), 0.0001);
  EXPECT_EQ(by_columns.sound, by_rows.sound);
  EXPECT_NE(by_columns.sound, Render(alone).sound);
}

TEST_F(AudioApi, AListenerHearsWhatTheMixerRenders) {
  std::vector<float> rendered = FromOnset(Render(Trace()).sound);
  ASSERT_GE(rendered.size(), 9000U);
  rendered.resize(rendered.size() - 480);  // which fade out
  const std::string scene = CreateScene();
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(scene), added).ok());
  std::vector<float> heard = FromOnset(Hear([&] {
    // The delay is that of the trace, for the same phase of the blocks.
    EXPECT_EQ(StrikeLive(scene, 0.5).accepted_count(), 1U);
  }));
  ASSERT_GE(heard.size(), rendered.size());
  // Bit for bit only where the strike falls into the same phase of the long blocks; else within
  // what the spectral form is accurate to, and modes fall asleep at other samples.
  float peak = 0, error = 0;
  for (size_t n = 0; n < rendered.size(); ++n) {
    peak = std::max(peak, std::abs(rendered[n]));
    error = std::max(error, std::abs(heard[n] - rendered[n]));
  }
  const auto asleep = static_cast<float>(OscillatorBankSettings{}.silence);
  EXPECT_LT(error, 1e-5F * peak + asleep);
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

TEST_F(AudioApi, TheMixerSaysHowItPlays) {
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(CreateScene()), added).ok());
  grpc::ClientContext context;
  v1::GetMixerResponse mixer;
  ASSERT_TRUE(audio->GetMixer(&context, {}, &mixer).ok());
  EXPECT_EQ(mixer.version(), "test");
  EXPECT_EQ(mixer.device(), "null");
  EXPECT_EQ(mixer.format().sample_rate_hz(), 48000U);
  EXPECT_EQ(mixer.block_frame_count(), 128U);
  EXPECT_DOUBLE_EQ(mixer.output_latency_s(), 8 * 128 / 48000.0);
  EXPECT_EQ(mixer.object_count(), 1U);
  EXPECT_GE(mixer.frame_count(), 8U * 128);  // what is rendered ahead before it serves
  EXPECT_NE(mixer.simd_target(), "");
}

TEST_F(AudioApi, ASecondDaemonOnTheSameSocketIsRefused) {
  EXPECT_THAT(PrepareSocket(address().substr(5)).status().ToString(),
              testing::HasSubstr("LISTEN_FAILED: "));
}

}  // namespace
}  // namespace carillon
