// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class AudioLevel : public ServedDaemon {
 protected:
  /// The summary of a rendering of one object that is struck once along x.
  v1::RenderSummary RenderStrike(double newton_seconds, double full_scale_pa = 0) {
    grpc::ClientContext context;
    const auto stream = audio->Render(&context);
    v1::RenderRequest request;
    request.mutable_settings()->set_tail_s(0.6);
    if (full_scale_pa != 0) request.mutable_settings()->set_full_scale_pa(full_scale_pa);
    stream->Write(request);
    request.mutable_record()->mutable_header()->set_format_version(1);
    stream->Write(request);
    v1::ContactTraceObject& object = *request.mutable_record()->mutable_object();
    object.set_handle(1);
    object.set_modal_model(ImportSmallModel());
    *object.mutable_material() = SmallMaterial();
    stream->Write(request);
    v1::Contact& impulse = *request.mutable_record()->mutable_step()->add_contacts() = Strike(1);
    impulse.mutable_impulse_newton_seconds()->set_x(newton_seconds);
    stream->Write(request);
    stream->WritesDone();
    v1::RenderResponse response;
    while (stream->Read(&response)) {
    }
    status = stream->Finish();
    EXPECT_EQ(status.ok(), full_scale_pa >= 0);
    return response.summary();
  }

  grpc::Status status;

  v1::GetMixerResponse Mixer() {
    grpc::ClientContext context;
    v1::GetMixerResponse mixer;
    EXPECT_TRUE(audio->GetMixer(&context, {}, &mixer).ok());
    return mixer;
  }
};

TEST_F(AudioLevel, ARenderingStatesPressureAndLoudness) {
  const v1::RenderSummary once = RenderStrike(1);
  EXPECT_GT(once.peak(), 0.0001);
  EXPECT_EQ(once.full_scale_pa(), 200);
  EXPECT_DOUBLE_EQ(once.peak_pa(), 200 * once.peak());
  EXPECT_GE(once.true_peak(), 0.99 * once.peak());
  ASSERT_TRUE(once.has_integrated_lufs() && once.has_loudest_momentary_lufs());
  EXPECT_GE(once.loudest_momentary_lufs(), once.integrated_lufs() - 0.1);
  // Half of the impulse is 6.02 dB less.
  const v1::RenderSummary half = RenderStrike(0.5);
  EXPECT_NEAR(once.loudest_momentary_lufs() - half.loudest_momentary_lufs(), 6.02, 0.01);
}

TEST_F(AudioLevel, TheReferenceLevelScalesTheSoundAndLeavesThePressure) {
  const v1::RenderSummary normal = RenderStrike(1);
  const v1::RenderSummary louder = RenderStrike(1, 20);
  EXPECT_EQ(louder.full_scale_pa(), 20);
  EXPECT_NEAR(louder.peak() / normal.peak(), 10, 1e-4);
  EXPECT_NEAR(louder.peak_pa() / normal.peak_pa(), 1, 1e-5);
  EXPECT_NEAR(louder.loudest_momentary_lufs() - normal.loudest_momentary_lufs(), 20, 0.01);
  RenderStrike(0.1, -1);
  EXPECT_NE(status.error_message().find("INVALID_SETTINGS: full_scale_pa is -1"),
            std::string::npos);
}

TEST_F(AudioLevel, ARenderingOfNextToNothingHasNoLoudness) {
  const v1::RenderSummary summary = RenderStrike(1e-9);
  EXPECT_FALSE(summary.has_integrated_lufs() || summary.has_loudest_momentary_lufs());
}

TEST_F(AudioLevel, TheMixerStatesTheLoudnessOfWhatItPlays) {
  v1::GetMixerResponse mixer = Mixer();
  EXPECT_FALSE(mixer.has_momentary_lufs() || mixer.has_short_term_lufs());
  const std::string scene = CreateScene();
  v1::AddObjectsResponse added;
  ASSERT_TRUE(Add(SmallObject(scene), added).ok());
  ASSERT_EQ(StrikeLive(scene).accepted_count(), 1U);
  while (!mixer.has_momentary_lufs()) mixer = Mixer();
  EXPECT_GT(mixer.momentary_lufs(), -70);
  EXPECT_EQ(mixer.full_scale_pa(), 200);
  EXPECT_DOUBLE_EQ(mixer.peak_pa(), 200 * mixer.peak());
  EXPECT_GT(mixer.peak_pa(), 0);
}

}  // namespace
}  // namespace carillon
