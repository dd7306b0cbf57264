// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class AudioLevel : public ServedDaemon {
 protected:
  /// The rendering of one object that is struck once along x.
  Rendering RenderStrike(double newton_seconds, double full_scale_pa = 0) {
    std::vector<v1::RenderRequest> requests = Trace();
    requests[0].mutable_settings()->set_tail_s(0.6);
    if (full_scale_pa != 0) requests[0].mutable_settings()->set_full_scale_pa(full_scale_pa);
    v1::ContactStep& step = *requests[3].mutable_record()->mutable_step();
    step.set_time_s(0);
    step.mutable_contacts(0)->mutable_impulse_newton_seconds()->set_x(newton_seconds);
    return Render(requests);
  }

  v1::GetMixerResponse Mixer() {
    grpc::ClientContext context;
    v1::GetMixerResponse mixer;
    EXPECT_TRUE(audio->GetMixer(&context, {}, &mixer).ok());
    return mixer;
  }
};

TEST_F(AudioLevel, ARenderingStatesPressureAndLoudness) {
  const v1::RenderSummary once = RenderStrike(1).summary;
  EXPECT_GT(once.peak(), 0.0001);
  EXPECT_EQ(once.full_scale_pa(), 200);
  EXPECT_DOUBLE_EQ(once.peak_pa(), 200 * once.peak());
  EXPECT_GE(once.true_peak(), 0.99 * once.peak());
  ASSERT_TRUE(once.has_integrated_lufs() && once.has_loudest_momentary_lufs());
  EXPECT_GE(once.loudest_momentary_lufs(), once.integrated_lufs() - 0.1);
  // Half of the impulse is 6.02 dB less.
  const v1::RenderSummary half = RenderStrike(0.5).summary;
  EXPECT_NEAR(once.loudest_momentary_lufs() - half.loudest_momentary_lufs(), 6.02, 0.01);
}

TEST_F(AudioLevel, TheReferenceLevelScalesTheSoundAndLeavesThePressure) {
  const v1::RenderSummary normal = RenderStrike(1).summary;
  const v1::RenderSummary louder = RenderStrike(1, 20).summary;
  EXPECT_EQ(louder.full_scale_pa(), 20);
  EXPECT_NEAR(louder.peak() / normal.peak(), 10, 1e-4);
  EXPECT_NEAR(louder.peak_pa() / normal.peak_pa(), 1, 1e-5);
  EXPECT_NEAR(louder.loudest_momentary_lufs() - normal.loudest_momentary_lufs(), 20, 0.01);
  ExpectRefused(RenderStrike(0.1, -1).status, grpc::INVALID_ARGUMENT, "INVALID_SETTINGS");
}

TEST_F(AudioLevel, ARenderingOfNextToNothingHasNoLoudness) {
  const v1::RenderSummary summary = RenderStrike(1e-9).summary;
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
