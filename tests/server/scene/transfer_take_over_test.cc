// SPDX-License-Identifier: Apache-2.0
//
// Objects that sound with a stored transfer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "server/scene/offline/offline_renderer.h"
#include "tests/server/scene/transfer_stage.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {
namespace {

ObjectProperties Radiating(RadiationModel radiation) {
  ObjectProperties properties = SmallProperties();
  properties.radiation = radiation;
  return properties;
}

/// The transfer of a body that is fixed somewhere, or that moves freely as a ball does.
SampleRadiation Ball(bool fixed) {
  return {.power_integrals = {0, 0, 0}, .rigid = SampleRigidBody(), .fixed = fixed};
}

TEST(TransferTakeOver, AnObjectTakesOverATransferThatComesWhileItSounds) {
  TransferStage stage;
  const uint32_t handle = stage.Add();
  const uint32_t paper = stage.Add(Radiating(RadiationModel::kPaperCoupling));
  EXPECT_EQ(stage.TryAdd(SmallProperties())->object.transfer, nullptr);
  stage.Strike(handle);
  const double by_coupling = Peak(stage.Render(100));
  stage.Store({.power_integrals = {0, 0, 0}});  // no mode radiates
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
  ObjectProperties properties = Radiating(RadiationModel::kRadiatedPower);
  EXPECT_EQ(ReasonOf(stage.TryAdd(properties).status()), "TRANSFER_NOT_FOUND");
  stage.Store({.power_integrals = {1, 1, 1}});
  EXPECT_TRUE(stage.TryAdd(properties).ok());
  properties.material.young_pa *= 1.3;  // sound travels 14 percent faster
  EXPECT_EQ(ReasonOf(stage.TryAdd(properties).status()), "TRANSFER_NOT_FOUND");
}

TEST(TransferTakeOver, TheAccelerationOfAFreeBodySoundsUnlessItsModesAloneAreAskedFor) {
  TransferStage stage;
  stage.Store(Ball(false));
  stage.Strike(stage.Add());
  const std::vector<float> click = stage.Render(200);
  EXPECT_GT(Peak(click), 0);
  const auto last =
      std::find_if(click.rbegin(), click.rend(), [](float sample) { return sample != 0; });
  EXPECT_LT(click.rend() - last, 1000) << "the click ends";
  stage.Strike(stage.Add(Radiating(RadiationModel::kModesOnly)));
  EXPECT_EQ(Peak(stage.Render(200)), 0);
  stage.Store(Ball(true));  // a body that is fixed hardly accelerates
  stage.Strike(stage.Add());
  EXPECT_EQ(Peak(stage.Render(200)), 0);
}

TEST(TransferTakeOver, ABodyWithoutAudibleModesClicks) {
  TransferStage stage;
  ObjectProperties properties = SmallProperties();
  properties.material.size = 0.01;  // its lowest mode is at 44 kHz
  const absl::Status status = stage.TryAdd(properties).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(status), "NO_MODE_IN_BAND");
  EXPECT_NEAR(std::stod(ToErrorInfo(status).metadata().at("first_mode_hz")), 44000, 1);
  stage.Store(Ball(false));
  const auto added = stage.TryAdd(properties);
  ASSERT_TRUE(added.ok()) << added.status();
  EXPECT_EQ(added->object.mode_count, 0U);
  // Ten times the mass times the speed of sound is the most that the body may bear.
  stage.Strike(added->handle, 1e-3);
  EXPECT_GT(Peak(stage.Render(20)), 0);
  EXPECT_EQ(Peak(stage.Render(20)), 0) << "the click has ended";
  properties.radiation = RadiationModel::kModesOnly;
  EXPECT_EQ(ReasonOf(stage.TryAdd(properties).status()), "NO_MODE_IN_BAND");
}

TEST(TransferTakeOver, ABlowIsToldWhenItSounds) {
  TransferStage stage;
  stage.Store(Ball(false));
  BodyCache bodies;
  const auto render = [&](double time_s) {
    auto renderer = *OfflineRenderer::Make({.tail_s = 0.1, .tells_blows = true}, bodies,
                                           &stage.database->transfers());
    EXPECT_TRUE(renderer->forward().AddObject(1, stage.model, SmallProperties()).ok());
    ObjectImpulse impulse = SmallImpulse(1);
    impulse.contact.impulse.duration_s = 0.004;
    StrikeAt(renderer->intake(), time_s, {impulse});
    std::vector<float> sound(1280);
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
    EXPECT_LT(LargestDifference(early, sound), 1e-5 * Peak(sound));
  }
  EXPECT_NEAR(render(0.0025).second, 0.0025, 1e-9);
}

TEST(TransferTakeOver, ARenderingCountsTheObjectsThatLackATransfer) {
  TransferStage stage;
  BodyCache bodies;
  auto renderer = *OfflineRenderer::Make({.tail_s = 0.1}, bodies, &stage.database->transfers());
  EXPECT_TRUE(renderer->forward().AddObject(1, stage.model, SmallProperties()).ok());
  const ObjectProperties by_coupling = Radiating(RadiationModel::kPaperCoupling);
  EXPECT_TRUE(renderer->forward().AddObject(2, stage.model, by_coupling).ok());
  EXPECT_EQ(renderer->summary().paper_coupling_object_count, 1U);
}

TEST(TransferTakeOver, RadiationDampsAnObject) {
  TransferStage stage;
  stage.Store({.power_integrals = {0, 0, 0}});
  EXPECT_EQ(stage.TryAdd(SmallProperties())->object.mode_count, 3U);
  stage.Store({.power_integrals = {0, 0, 3e7F}});  // the highest mode loses all within 2 ms
  EXPECT_EQ(stage.TryAdd(SmallProperties())->object.mode_count, 2U);
}

/// Turned about the y axis.
Pose TurnedBy(double angle) {
  return {.orientation = {std::cos(angle / 2), 0, std::sin(angle / 2), 0}};
}

class DirectedObjects : public testing::Test, protected TransferStage {
 protected:
  /// All modes are dipoles along z.
  void StoreDipoles() { Store({.power_integrals = {1, 1, 1}, .harmonics = {2, 2, 2}}); }

  /// Goes on with another scene, of one object.
  void Enter(const HearingSettings& hearing, const Pose& listener = {}) {
    scene = *scenes.CreateScene({.hearing = hearing, .listener = listener});
    ASSERT_EQ(Add(), 1U);
  }

  /// The root mean square of a strike on the object in this pose, without its start.
  double StrikeIn(const Pose& pose) {
    ObjectChange change;
    change.pose = pose;
    EXPECT_TRUE(scenes.UpdateObject(scene, 1, change).ok());
    Render(4000);  // until all has died away
    Strike(1, 0.01);
    Render(10);
    return Rms(Render(100));
  }
};

TEST_F(DirectedObjects, AreEqualInAllDirectionsUntilTheirTransferComes) {
  Enter({.directivity = true}, {.position_m = {1, 0, 0}});
  const double by_coupling = StrikeIn({});
  EXPECT_GT(by_coupling, 0);
  EXPECT_EQ(StrikeIn(TurnedBy(1)), by_coupling);
  StoreDipoles();
  // The listener is in the plane in which a dipole is silent.
  EXPECT_LT(StrikeIn({}), 1e-5 * StrikeIn(TurnedBy(1)));
}

TEST_F(DirectedObjects, AreAsLoudAsTheyRadiateTowardsTheListener) {
  StoreDipoles();
  Enter({.distance_gain = true});
  const double everywhere = StrikeIn({});
  Enter({.directivity = true}, {.position_m = {0, 0, 5}});
  for (const double angle : {0.0, 0.5, 1.2, 2.0, 3.0}) {
    // A dipole is sqrt(3) cos(theta) times as loud as its mean.
    EXPECT_NEAR(StrikeIn(TurnedBy(angle)) / everywhere,
                std::numbers::sqrt3 * std::abs(std::cos(angle)), 0.02)
        << angle;
  }
}

TEST_F(DirectedObjects, NearFieldWithoutDirectivityIsRefused) {
  const SceneSpace space{.hearing = {.near_field = true}, .listener = {}};
  EXPECT_EQ(ReasonOf(scenes.CreateScene(space).status()), "INVALID_SETTINGS");
}

}  // namespace
}  // namespace carillon
