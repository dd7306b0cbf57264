// SPDX-License-Identifier: Apache-2.0
// Objects of a scene whose listener hears their directions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "server/mode_database/mode_database.h"
#include "server/scene/offline/offline_renderer.h"
#include "server/scene/scene_registry.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/mode_database/sample_transfer.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

constexpr size_t kBlock = OfflineRenderer::kBlockFrameCount;
constexpr double kStepS = 1.0 / 60;
constexpr HearingSettings kDirected{.directivity = true};

double Peak(const std::vector<float>& sound) {
  double peak = 0;
  for (const float sample : sound) peak = std::max(peak, std::abs(double{sample}));
  return peak;
}

/// Turned about the y axis.
Pose TurnedBy(double angle) {
  return {.orientation = {std::cos(angle / 2), 0, std::sin(angle / 2), 0}};
}

/// SmallModel in a database.
class DirectedObjects : public testing::Test {
 protected:
  DirectedObjects() {
    WriteRecords(folder_ / "model", SampleRecords(*SmallModel()));
    EXPECT_TRUE(database_->models().PutFile(SmallModel()->digest, "", folder_ / "model").ok());
  }

  void SetUp() override {
    database_->transfers().Listen([this](const std::string& d) { scenes_.TakeOverTransfers(d); });
  }
  void TearDown() override { database_->transfers().Listen(nullptr); }

  /// All modes are dipoles along z.
  void StoreDipoles() {
    const double speed_m_per_s = std::sqrt(kTestYoungPa / kTestDensityKgPerM3);
    const auto stored = database_->transfers().Put(
        SmallModel()->digest, SampleTransfer(*SmallModel(), {.speed_ratio = speed_m_per_s / 343,
                                                             .power_integrals = {1, 1, 1},
                                                             .harmonics = {2, 2, 2}}));
    EXPECT_TRUE(stored.ok()) << stored.status();
  }

  uint64_t MakeScene(const HearingSettings& hearing, const Pose& listener = {}) {
    const uint64_t scene = *scenes_.CreateScene({.hearing = hearing, .listener = listener});
    EXPECT_TRUE(scenes_.AddObject(scene, 1, Model(), SmallProperties()).ok());
    return scene;
  }

  /// The root mean square of a strike on an object in this pose, without its start.
  double Strike(uint64_t scene, const Pose& pose = {}) {
    ObjectChange change;
    change.pose = pose;
    EXPECT_TRUE(scenes_.UpdateObject(scene, 1, change).ok());
    Render(4000);  // until all has died away
    const auto stream =
        *scenes_.OpenContactStream(scene, {.step_s = kStepS, .scheduling_delay_s = 0});
    EXPECT_TRUE(stream->intake().BeginStep(0).ok());
    stream->intake().Strike(SmallImpulse(1, 0.01));
    stream->intake().EndStep();
    Render(10);
    double square = 0;
    for (const float sample : Render(100)) square += double{sample} * sample;
    return std::sqrt(square);
  }

  std::vector<float> Render(size_t block_count) {
    std::vector<float> sound(block_count * kBlock);
    mixer_.Render(sound);
    return sound;
  }

  std::shared_ptr<const ModalModel> Model() {
    return *database_->models().Find(SmallModel()->digest);
  }

  TemporaryFolder folder_;
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_ = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  Mixer mixer_{MixerSettings{.sample_rate_hz = 48000, .block_frame_count = kBlock}};
  SceneRegistry scenes_{mixer_, &database_->transfers()};
};

TEST_F(DirectedObjects, AreEqualInAllDirectionsUntilTheirTransferComes) {
  const uint64_t before = MakeScene(kDirected, {.position_m = {1, 0, 0}});
  const double by_coupling = Strike(before);
  EXPECT_GT(by_coupling, 0);
  EXPECT_EQ(Strike(before, TurnedBy(1)), by_coupling);
  StoreDipoles();
  // The listener is in the plane in which a dipole is silent.
  EXPECT_LT(Strike(before), 1e-5 * Strike(before, TurnedBy(1)));
}

TEST_F(DirectedObjects, AreAsLoudAsTheyRadiateTowardsTheListener) {
  StoreDipoles();
  const double everywhere = Strike(MakeScene({.distance_gain = true}));
  const uint64_t scene = MakeScene(kDirected, {.position_m = {0, 0, 5}});
  for (const double angle : {0.0, 0.5, 1.2, 2.0, 3.0}) {
    // A dipole is sqrt(3) cos(theta) times as loud as its mean.
    EXPECT_NEAR(Strike(scene, TurnedBy(angle)) / everywhere,
                std::numbers::sqrt3 * std::abs(std::cos(angle)), 0.02)
        << angle;
  }
}

TEST_F(DirectedObjects, NearFieldWithoutDirectivityIsRefused) {
  EXPECT_THAT(
      scenes_.CreateScene({.hearing = {.near_field = true}, .listener = {}}).status().ToString(),
      testing::HasSubstr("INVALID_SETTINGS: near_field works only with directivity"));
}

/// The object turns and walks, the listener walks round, and there is a strike in every third step.
void Simulate(ContactIntake& intake) {
  for (int step = 0; step < 60; ++step) {
    const double time_s = step * kStepS;
    ASSERT_TRUE(intake.BeginStep(time_s).ok());
    Pose pose = TurnedBy(6 * time_s);
    pose.position_m = {0, time_s, 0};
    intake.Move(1, pose);
    intake.MoveListener({.position_m = {std::cos(2 * time_s), 0, std::sin(2 * time_s)}});
    if (step % 3 == 0) intake.Strike(SmallImpulse(1, 0.3, 0.4 * kStepS));
    intake.EndStep();
  }
}

TEST_F(DirectedObjects, SoundOfflineBitForBitAsLiveAndForAnyNumberOfThreads) {
  StoreDipoles();
  const HearingSettings hearing{
      .distance_gain = true, .propagation_delay = true, .directivity = true, .near_field = true};
  const uint64_t scene = MakeScene(hearing);
  const auto stream =
      *scenes_.OpenContactStream(scene, {.step_s = kStepS, .scheduling_delay_s = 0.03});
  Simulate(stream->intake());
  const std::vector<float> live = Render(400);
  EXPECT_GT(Peak(live), 0.001);
  for (const size_t thread_count : {1U, 3U}) {
    BodyCache bodies;
    const auto renderer =
        *OfflineRenderer::Make({.sample_rate_hz = 48000,
                                .tail_s = 1,
                                .step_s = kStepS,
                                .space = {.hearing = hearing, .listener = {}},
                                .mapping = {.first_frame = *stream->first_frame(), .delay_s = 0.03},
                                .thread_count = thread_count},
                               bodies, &database_->transfers());
    ASSERT_TRUE(renderer->forward().AddObject(1, Model(), SmallProperties()).ok());
    Simulate(renderer->intake());
    std::vector<float> offline(live.size());
    renderer->forward().Finish();
    ASSERT_EQ(renderer->Render(offline), offline.size());
    EXPECT_EQ(offline, live);
  }
}

}  // namespace
}  // namespace carillon
