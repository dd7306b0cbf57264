// SPDX-License-Identifier: Apache-2.0
//
// Objects that sound with a stored transfer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "server/mode_database/mode_database.h"
#include "server/scene/offline/offline_renderer.h"
#include "server/scene/scene_registry.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/mode_database/sample_transfer.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using testing::HasSubstr;

constexpr size_t kBlock = 128;

double Peak(const std::vector<float>& sound) {
  double peak = 0;
  for (const float sample : sound) peak = std::max(peak, std::abs(double{sample}));
  return peak;
}

/// SmallModel in a database, and a stage whose objects sound with the transfers there.
class TransferStage {
 public:
  TransferStage() {
    WriteRecords(folder / "model", SampleRecords(*SmallModel()));
    EXPECT_TRUE(database->models().PutFile(SmallModel()->digest, "", folder / "model").ok());
    database->transfers().Listen([this](const std::string& d) { scenes.TakeOverTransfers(d); });
  }
  ~TransferStage() { database->transfers().Listen(nullptr); }

  PlacedObject Add(RadiationModel radiation = RadiationModel::kDefault) {
    ObjectProperties properties = SmallProperties();
    properties.radiation = radiation;
    return *scenes.AddObject(scene, 0, *database->models().Find(SmallModel()->digest), properties);
  }

  /// The transfer of a body that is fixed somewhere, or that moves freely as a ball does.
  void StoreBall(bool fixed) {
    const double speed_m_per_s = std::sqrt(kTestYoungPa / kTestDensityKgPerM3);
    const auto stored = database->transfers().Put(
        SmallModel()->digest, SampleTransfer(*SmallModel(), {.speed_ratio = speed_m_per_s / 343,
                                                             .power_integrals = {0, 0, 0},
                                                             .rigid = SampleRigidBody(),
                                                             .fixed = fixed}));
    EXPECT_TRUE(stored.ok()) << stored.status();
  }

  void Store(std::vector<float> integrals) {
    const double speed_m_per_s = std::sqrt(kTestYoungPa / kTestDensityKgPerM3);
    const auto stored = database->transfers().Put(
        SmallModel()->digest,
        SampleTransfer(*SmallModel(), {.speed_ratio = speed_m_per_s / 343,
                                       .power_integrals = std::move(integrals)}));
    EXPECT_TRUE(stored.ok()) << stored.status();
  }

  std::vector<float> Render(size_t block_count) {
    std::vector<float> sound(block_count * kBlock);
    mixer.Render(sound);
    return sound;
  }

  void Strike(uint32_t handle) {
    const auto stream = *scenes.OpenContactStream(scene, {.step_s = 0.01, .scheduling_delay_s = 0});
    ASSERT_TRUE(stream->intake().BeginStep(0).ok());
    stream->intake().Strike(SmallImpulse(handle));
    stream->intake().EndStep();
    ASSERT_EQ(stream->counts().rejected_count, 0U);
  }

  TemporaryFolder folder;
  SystemClock clock;
  std::unique_ptr<ModeDatabase> database = *ModeDatabase::Open(folder / "carillon.db", clock);
  Mixer mixer{MixerSettings{.sample_rate_hz = 48000, .block_frame_count = kBlock}};
  SceneRegistry scenes{mixer, &database->transfers()};
  uint64_t scene = *scenes.CreateScene();
};

TEST(TransferTakeOver, AnObjectTakesOverATransferThatComesWhileItSounds) {
  TransferStage stage;
  const uint32_t handle = stage.Add().handle;
  const uint32_t paper = stage.Add(RadiationModel::kPaperCoupling).handle;
  EXPECT_EQ(stage.Add().object.transfer, nullptr);
  stage.Strike(handle);
  const double by_coupling = Peak(stage.Render(100));
  stage.Store({0, 0, 0});  // no mode radiates
  const auto quiet = *stage.scenes.UpdateObject(stage.scene, handle, {});
  EXPECT_NE(quiet.object.transfer, nullptr);
  stage.Strike(handle);
  // What rings goes on without a step: the modes together move by 0.11 of their peak in a sample.
  const std::vector<float> rest = stage.Render(1000);
  EXPECT_GT(Peak(rest), 0);
  EXPECT_LT(Peak(rest), by_coupling);
  for (size_t i = 1; i < rest.size(); ++i) {
    ASSERT_LT(std::abs(rest[i] - rest[i - 1]), 0.15 * by_coupling) << i;
  }
  stage.Render(10000);
  stage.Strike(handle);
  EXPECT_EQ(Peak(stage.Render(100)), 0) << "the old bank has rung out, and the new one is silent";
  stage.Strike(paper);
  EXPECT_NEAR(Peak(stage.Render(100)), by_coupling, 1e-3 * by_coupling);
}

TEST(TransferTakeOver, RadiatedPowerIsRefusedUntilATransferIsStored) {
  TransferStage stage;
  ObjectProperties properties = SmallProperties();
  properties.radiation = RadiationModel::kRadiatedPower;
  const auto model = *stage.database->models().Find(SmallModel()->digest);
  const auto add = [&] {
    return stage.scenes.AddObject(stage.scene, 0, model, properties).status();
  };
  EXPECT_THAT(add().ToString(), HasSubstr("TRANSFER_NOT_FOUND: "));
  stage.Store({1, 1, 1});
  EXPECT_TRUE(add().ok());
  properties.material.young_pa *= 1.3;  // sound travels 14 percent faster
  EXPECT_THAT(add().ToString(), HasSubstr("TRANSFER_NOT_FOUND: "));
}

TEST(TransferTakeOver, TheAccelerationOfAFreeBodySoundsUnlessItsModesAloneAreAskedFor) {
  TransferStage stage;
  stage.StoreBall(false);
  const uint32_t ball = stage.Add().handle;
  const uint32_t modes_only = stage.Add(RadiationModel::kModesOnly).handle;
  stage.Strike(ball);
  const std::vector<float> click = stage.Render(200);
  EXPECT_GT(Peak(click), 0);
  const auto last =
      std::find_if(click.rbegin(), click.rend(), [](float sample) { return sample != 0; });
  EXPECT_LT(click.rend() - last, 1000) << "the click ends";
  stage.Strike(modes_only);
  EXPECT_EQ(Peak(stage.Render(200)), 0);
}

TEST(TransferTakeOver, ABodyWithoutAudibleModesClicks) {
  TransferStage stage;
  ObjectProperties properties = SmallProperties();
  properties.material.size = 0.01;  // its lowest mode is at 44 kHz
  const auto model = *stage.database->models().Find(SmallModel()->digest);
  const auto add = [&] { return stage.scenes.AddObject(stage.scene, 0, model, properties); };
  EXPECT_THAT(add().status().ToString(), HasSubstr("NO_MODE_IN_BAND: "));
  stage.StoreBall(false);
  const auto added = add();
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->object.mode_count, 0U);
  const auto stream =
      *stage.scenes.OpenContactStream(stage.scene, {.step_s = 0.01, .scheduling_delay_s = 0});
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  // Ten times the mass times the speed of sound is the most that the body may bear.
  stream->intake().Strike(SmallImpulse(added->handle, 1e-3));
  stream->intake().EndStep();
  EXPECT_EQ(stream->counts().rejected_count, 0U);
  const std::vector<float> click = stage.Render(20);
  EXPECT_GT(Peak(click), 0);
  EXPECT_EQ(Peak(stage.Render(20)), 0) << "the click has ended";
  properties.radiation = RadiationModel::kModesOnly;
  EXPECT_THAT(add().status().ToString(), HasSubstr("NO_MODE_IN_BAND: "));
}

TEST(TransferTakeOver, ABlowIsToldWhenItSounds) {
  TransferStage stage;
  stage.StoreBall(false);
  BodyCache bodies;
  const auto model = *stage.database->models().Find(SmallModel()->digest);
  const auto render = [&](double time_s) {
    auto renderer = *OfflineRenderer::Make({.tail_s = 0.1, .tells_blows = true}, bodies,
                                           &stage.database->transfers());
    EXPECT_TRUE(renderer->forward().AddObject(1, model, SmallProperties()).ok());
    ObjectImpulse impulse = SmallImpulse(1);
    impulse.contact.impulse.duration_s = 0.004;
    EXPECT_TRUE(renderer->intake().BeginStep(time_s).ok());
    renderer->intake().Strike(impulse);
    renderer->intake().EndStep();
    std::vector<float> sound(10 * kBlock);
    renderer->forward().Finish();
    renderer->Render(sound);
    EXPECT_EQ(renderer->summary().paper_coupling_object_count, 0U);
    return std::pair(sound, renderer->forward().TakeBlows().at(0).time_s);
  };
  const auto [sound, time_s] = render(0.002);
  EXPECT_NEAR(time_s, 0.002, 1e-9);
  EXPECT_GT(Peak(sound), 0);
  for (const double early_s : {0.0, 0.0015}) {
    const auto [early, told_s] = render(early_s);
    // A duration is stored in single precision.
    EXPECT_NEAR(told_s, 0.002, 1e-9) << "the contact begins with the first frame";
    for (size_t n = 0; n < sound.size(); ++n) ASSERT_NEAR(early[n], sound[n], 1e-5 * Peak(sound));
  }
  EXPECT_NEAR(render(0.0025).second, 0.0025, 1e-9);
}

TEST(TransferTakeOver, ARenderingCountsTheObjectsThatLackATransfer) {
  TransferStage stage;
  BodyCache bodies;
  const auto model = *stage.database->models().Find(SmallModel()->digest);
  auto renderer = *OfflineRenderer::Make({.tail_s = 0.1}, bodies, &stage.database->transfers());
  ObjectProperties properties = SmallProperties();
  EXPECT_TRUE(renderer->forward().AddObject(1, model, properties).ok());
  properties.radiation = RadiationModel::kPaperCoupling;
  EXPECT_TRUE(renderer->forward().AddObject(2, model, properties).ok());
  EXPECT_EQ(renderer->summary().paper_coupling_object_count, 1U);
}

TEST(TransferTakeOver, TheAccelerationOfAFixedBodyIsSilent) {
  TransferStage stage;
  stage.StoreBall(true);
  stage.Strike(stage.Add().handle);
  EXPECT_EQ(Peak(stage.Render(200)), 0);
}

TEST(TransferTakeOver, RadiationDampsAnObject) {
  TransferStage stage;
  stage.Store({0, 0, 0});
  const auto undamped = stage.Add().object;
  EXPECT_EQ(undamped.mode_count, 3U);
  stage.Store({0, 0, 3e7F});  // the highest mode loses all within 2 ms
  EXPECT_EQ(stage.Add().object.mode_count, 2U);
}

}  // namespace
}  // namespace carillon
