// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene_registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "proto/cpp/error_reason.h"
#include "server/scene/body_impulses.h"
#include "server/scene/sounding_body.h"
#include "tests/server/scene/stage.h"
#include "tests/server/synthesis/sound.h"

namespace carillon {
namespace {

using testing::Each;
using testing::HasSubstr;

TEST(SceneRegistry, AnObjectStatesItsModesAndUpToWhereTheyAreComplete) {
  Stage stage;
  ObjectProperties properties = SmallProperties();
  const PlacedObject placed = *stage.TryAdd(properties);
  EXPECT_EQ(placed.object.mode_count, 3U);
  EXPECT_NEAR(placed.object.lowest_frequency_hz, 440, 1e-9);
  EXPECT_NEAR(placed.object.highest_frequency_hz, 5000, 1e-9);
  EXPECT_EQ(placed.object.complete_to_hz, std::nullopt);
  properties.material.young_pa /= 16;  // a quarter of every frequency: complete to 12.5 kHz
  const PlacedObject duller = *stage.TryAdd(properties);
  ASSERT_TRUE(duller.object.complete_to_hz.has_value());
  EXPECT_NEAR(*duller.object.complete_to_hz, 12500, 1e-6);
}

TEST(SceneRegistry, APoissonRatioNearbyChangesEachFrequencyByItsSlopeIfThatIsKnown) {
  Stage stage;
  ObjectProperties properties = SmallProperties();
  properties.poisson_ratio = 0.3302;
  const absl::Status status = stage.TryAdd(properties).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(status), "POISSON_RATIO_DIFFERS");
  properties.poisson_ratio = 0.3301;  // the tolerance the contract states
  EXPECT_TRUE(stage.TryAdd(properties).ok());
  auto model = std::make_shared<ModalModel>(*SmallModel());
  // Torsion, a bar's bending and a plate's: 1/(1 + nu), 1 and 1/(1 - nu^2).
  model->poisson_slopes = {-1 / 1.33, 0, 0.66 / (1 - 0.33 * 0.33)};
  stage.model = model;
  properties.poisson_ratio = 0.27;
  const PlacedObject placed = *stage.TryAdd(properties);
  EXPECT_NEAR(placed.object.lowest_frequency_hz, 440 * std::sqrt(1.33 / 1.27), 1e-6);
  EXPECT_NEAR(placed.object.highest_frequency_hz,
              5000 * std::sqrt((1 - 0.33 * 0.33) / (1 - 0.27 * 0.27)), 1e-6);
  properties.poisson_ratio = 0.25;
  EXPECT_EQ(ReasonOf(stage.TryAdd(properties).status()), "POISSON_RATIO_DIFFERS");
}

/// SmallModel as a body of two regions, of which the soft one has most of the first mode's energy.
std::shared_ptr<const ModalModel> ModelOfRegions() {
  auto model = std::make_shared<ModalModel>(*SmallModel());
  model->regions = {{.name = "hard",
                     .poisson_ratio = 0.33,
                     .strain_energy_parts = {0.25, 0.5, 1},
                     .kinetic_energy_parts = {0.75, 0.5, 1}},
                    {.name = "soft",
                     .relative_young = 0.1,
                     .relative_density = 0.5,
                     .poisson_ratio = 0.2,
                     .strain_energy_parts = {0.75, 0.5, 0},
                     .kinetic_energy_parts = {0.25, 0.5, 0}}};
  model->given_triangle_regions = {0, 0, 1, 1};
  model->mass_kg = 2e-4;
  return model;
}

/// Materials that fit ModelOfRegions.
ObjectProperties PropertiesOfRegions() {
  ObjectProperties properties;
  properties.material.regions = {{.region = "",
                                  .young_pa = kTestYoungPa / 10,
                                  .density_kg_per_m3 = kTestDensityKgPerM3 / 2,
                                  .poisson_ratio = std::nullopt,
                                  .damping = {.alpha2_per_s = 8, .loss_factor = {{1000, 0.01}}}},
                                 {.region = "HARD",
                                  .young_pa = kTestYoungPa,
                                  .density_kg_per_m3 = kTestDensityKgPerM3,
                                  .poisson_ratio = 0.33}};
  return properties;
}

TEST(SceneRegistry, RegionsDampAModeByTheirPartsOfItsEnergies) {
  Stage stage;
  stage.model = ModelOfRegions();
  const auto placed = stage.TryAdd(PropertiesOfRegions());
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->object.lowest_frequency_hz, 440, 1e-9);
  const double omega = 2 * std::numbers::pi * 440;
  EXPECT_NEAR(placed->object.yielding->modes[0].decay_rate_per_s,
              -(0.75 * 0.01 * omega + 0.25 * 8) / 2, 1e-4);
  EXPECT_EQ(placed->object.yielding->modes[2].decay_rate_per_s, 0);
  EXPECT_EQ(placed->object.properties.material.regions[1].region, "soft");
}

TEST(SceneRegistry, RegionsAreScaledByCommonFactorsOnly) {
  Stage stage;
  stage.model = ModelOfRegions();
  ObjectProperties scaled = PropertiesOfRegions();
  for (RegionMaterial& region : scaled.material.regions) region.young_pa *= 4;
  const auto placed = stage.TryAdd(scaled);
  ASSERT_TRUE(placed.ok()) << placed.status();
  EXPECT_NEAR(placed->object.lowest_frequency_hz, 880, 1e-6);
  const auto refusal = [&](const ObjectProperties& properties) {
    return ReasonOf(stage.TryAdd(properties).status());
  };
  scaled.material.regions[0].young_pa *= 1.01;
  EXPECT_EQ(refusal(scaled), "REGION_MATERIAL_DIFFERS");
  ObjectProperties other = PropertiesOfRegions();
  other.material.regions[0].poisson_ratio = 0.21;
  EXPECT_EQ(refusal(other), "REGION_MATERIAL_DIFFERS");
  other = PropertiesOfRegions();
  other.material.regions.push_back({.region = "none", .poisson_ratio = std::nullopt});
  EXPECT_THAT(stage.TryAdd(other).status().ToString(), HasSubstr("for the region \"none\""));
  EXPECT_EQ(refusal(SmallProperties()), "REGION_MATERIAL_DIFFERS");
  stage.model = SmallModel();
  EXPECT_EQ(refusal(PropertiesOfRegions()), "REGION_MATERIAL_DIFFERS");
}

TEST(SceneRegistry, RefusesShapesAndCouplingsThatNoBodyOfTheSizeHas) {
  Stage stage;
  ModalModel model = *SmallModel();
  const auto add = [&] {
    stage.model = std::make_shared<ModalModel>(model);
    return stage.TryAdd(SmallProperties()).status();
  };
  // A part of 1e-8 of the mass may vibrate alone. The mass is the volume: 0.1^3 / 6.
  const auto most = static_cast<float>(1 / std::sqrt(1e-8 * 1e-3 / 6));
  for (const float shape : {1.01F * most, -3e38F, std::numeric_limits<float>::infinity()}) {
    model.shapes[5] = shape;
    EXPECT_EQ(ReasonOf(add()), "MODAL_MODEL_MALFORMED") << shape;
  }
  model.shapes[5] = 0.99F * most;
  EXPECT_TRUE(add().ok());
  model.couplings[1] = 1e300;
  EXPECT_EQ(ReasonOf(add()), "MODAL_MODEL_MALFORMED");
}

TEST(SceneRegistry, HandlesAreTheClientsOrTheLowestThatIsFree) {
  Stage stage;
  EXPECT_EQ(stage.Add(), 1U);
  EXPECT_EQ(stage.scenes.AddObject(stage.scene, 2, SmallModel(), SmallProperties())->handle, 2U);
  EXPECT_EQ(stage.Add(), 3U);
  const absl::Status taken =
      stage.scenes.AddObject(stage.scene, 2, SmallModel(), SmallProperties()).status();
  EXPECT_EQ(taken.code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(ReasonOf(taken), "OBJECT_EXISTS");
  ASSERT_TRUE(stage.scenes.RemoveObject(stage.scene, 1).ok());
  EXPECT_EQ(stage.Add(), 1U);
}

TEST(SceneRegistry, AddsNothingForACallerThatHasGoneOrASceneThatIsDeletedMeanwhile) {
  Stage stage;
  const std::vector<NewObject> objects(3, {.model = SmallModel(), .properties = SmallProperties()});
  int made_count = 0;
  const auto gone = stage.scenes.AddObjects(stage.scene, objects, [&] { return ++made_count < 3; });
  EXPECT_EQ(gone.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(stage.scenes.object_count(), 0U);
  const auto deleted = stage.scenes.AddObjects(stage.scene, objects, [&] {
    EXPECT_EQ(stage.scenes.object_count(), 3U);  // they count while they are made
    return stage.scenes.DeleteScene(stage.scene).ok();
  });
  EXPECT_EQ(ReasonOf(deleted.status()), "SCENE_NOT_FOUND");
  EXPECT_EQ(stage.scenes.object_count(), 0U);
}

TEST(SceneRegistry, AnObjectIsHeardFromWhereTheListenerWentWhileItWasMade) {
  const SceneSpace space{.hearing = {.distance_gain = true}, .listener = {}};
  Stage stage(space), other(space);
  const std::vector<NewObject> objects(2, {.model = SmallModel(), .properties = SmallProperties()});
  bool one_is_made = false;
  const auto placed = stage.scenes.AddObjects(stage.scene, objects, [&] {
    // The listener goes away once the first object is made.
    if (!std::exchange(one_is_made, true)) return true;
    return stage.scenes.UpdateListener(stage.scene, {.position_m = {0, 0, 100}}, 0).ok();
  });
  ASSERT_TRUE(placed.ok()) << placed.status();
  stage.Strike(placed->front().handle);
  const double first_peak = Peak(stage.Render(20));
  ASSERT_TRUE(other.scenes.UpdateListener(other.scene, {.position_m = {0, 0, 100}}, 0).ok());
  other.Strike(other.Add());
  const double far_peak = Peak(other.Render(20));
  EXPECT_GT(far_peak, 0);
  EXPECT_NEAR(first_peak, far_peak, 0.01 * far_peak);
}

TEST(SceneRegistry, TheNumberOfScenesIsLimited) {
  Stage stage;
  for (size_t i = 1; i < SceneRegistry::kMaxSceneCount; ++i) {
    ASSERT_TRUE(stage.scenes.CreateScene().ok());
  }
  const absl::Status status = stage.scenes.CreateScene().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(status), "TOO_MANY_SCENES");
  ASSERT_TRUE(stage.scenes.DeleteScene(stage.scene).ok());
  EXPECT_TRUE(stage.scenes.CreateScene().ok());
}

TEST(SceneRegistry, TheNumberOfObjectsIsLimitedOverAllScenes) {
  Stage stage;
  const uint64_t other = *stage.scenes.CreateScene();
  const auto add = [&](uint64_t scene) {
    return stage.scenes.AddObject(scene, 0, stage.model, SmallProperties()).status();
  };
  for (size_t i = 0; i < SceneRegistry::kMaxObjectCount; ++i) {
    ASSERT_TRUE(add(i % 2 == 0 ? stage.scene : other).ok());
  }
  EXPECT_EQ(add(other).code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(add(other)), "TOO_MANY_OBJECTS");
  ASSERT_TRUE(stage.scenes.DeleteScene(stage.scene).ok());
  EXPECT_EQ(stage.scenes.object_count(), SceneRegistry::kMaxObjectCount / 2);
  EXPECT_TRUE(add(other).ok());
}

TEST(SceneRegistry, WhateverChangesWhatRingsGoesOnBitForBitAndWhatIsStruckSoundsTheNewWay) {
  ObjectChange larger, softer, louder, mute;
  larger.size = 3;
  softer.material = SmallProperties().material;
  softer.material->young_pa /= 9;
  softer.material->loss_factor = {{.frequency_hz = 1000, .loss_factor = 0.01}};
  louder.gain = 10;
  mute.gain = 0;
  for (const ObjectChange& change : {larger, softer, louder, mute}) {
    Stage stage, untouched;
    const uint32_t handle = stage.Add();
    untouched.Strike(untouched.Add());
    stage.Strike(handle);
    ASSERT_EQ(stage.Render(7), untouched.Render(7));
    const auto changed = stage.scenes.UpdateObject(stage.scene, handle, change);
    ASSERT_TRUE(changed.ok());
    EXPECT_EQ(changed->object.properties.gain, change.gain.value_or(1));
    if (change.gain == 0) stage.Strike(handle);  // adds nothing
    const std::vector<float> sound = stage.Render(40);
    EXPECT_GT(Peak(sound), 1e-3);
    EXPECT_EQ(sound, untouched.Render(40));
  }
}

TEST(SceneRegistry, AnUpdateKeepsWhatItDoesNotName) {
  Stage stage;
  const uint32_t handle = stage.Add();
  ObjectChange twice_as_large;
  twice_as_large.size = 2;
  ASSERT_TRUE(stage.scenes.UpdateObject(stage.scene, handle, twice_as_large).ok());
  SoundingMaterial stiffer = SmallProperties().material;
  stiffer.young_pa *= 4;
  ObjectChange change;
  change.material = stiffer;
  const PlacedObject placed = *stage.scenes.UpdateObject(stage.scene, handle, change);
  EXPECT_EQ(placed.object.properties.material.size, 2);
  EXPECT_NEAR(placed.object.lowest_frequency_hz, 440, 1e-9);  // twice as large, four times as stiff
  EXPECT_EQ(stage.scenes.object_count(), 1U);
}

TEST(SceneRegistry, AnObjectThatRingsIsHeardWhereItGoesAndFromWhereTheListenerGoes) {
  Stage stage({.hearing = {.panning = true}, .listener = {}}, {.channel_count = 2});
  ObjectProperties properties = SmallProperties();
  properties.pose = Pose{.position_m = {-1, 0, 0}};
  const uint32_t handle = stage.Add(properties);
  stage.Strike(handle);
  const auto left_to_right = [&] {
    const std::vector<float> sound = stage.Render(10);
    double left = 0, right = 0;
    for (size_t n = 0; n < sound.size(); n += 2) {
      left += sound[n] * sound[n];
      right += sound[n + 1] * sound[n + 1];
    }
    return std::sqrt(left / right);
  };
  EXPECT_GT(left_to_right(), 1000);
  ObjectChange change;
  change.pose = Pose{.position_m = {1, 0, 0}};
  change.glide_s = 0.01;
  const PlacedObject placed = *stage.scenes.UpdateObject(stage.scene, handle, change);
  EXPECT_EQ(placed.object.properties.pose->position_m[0], 1);
  stage.Render(20);
  EXPECT_LT(left_to_right(), 0.001);
  ASSERT_TRUE(stage.scenes.UpdateListener(stage.scene, {.position_m = {2, 0, 0}}, 0).ok());
  stage.Render(10);
  EXPECT_GT(left_to_right(), 1000);
}

TEST(SceneRegistry, ARemovedObjectFadesOut) {
  Stage stage;
  const uint32_t handle = stage.Add();
  stage.Strike(handle);
  stage.Render(4);
  ASSERT_TRUE(stage.scenes.RemoveObject(stage.scene, handle).ok());
  EXPECT_GT(Peak(stage.Render(1)), 1e-4);  // no click: it does not stop at once
  stage.Render(8);                         // over 10 ms
  EXPECT_THAT(stage.Render(4), Each(0.0F));
  EXPECT_EQ(stage.scenes.object_count(), 0U);
}

TEST(SceneRegistry, AnUpdateKeepsThePoseThatAContactStreamSetsWhileTheBankIsMade) {
  Stage stage;
  const uint32_t handle = stage.Add();
  const auto stream = stage.Open();
  ASSERT_TRUE(stream->intake().BeginStep(0).ok());
  std::atomic<bool> done{false};
  std::thread updates([&] {
    ObjectChange change;
    for (int i = 0; i < 1000; ++i) {
      change.gain = 1 + i % 2;
      EXPECT_TRUE(stage.scenes.UpdateObject(stage.scene, handle, change).ok());
    }
    done = true;
  });
  double lost_count = 0;
  for (double x = 1; !done; ++x) {
    stream->intake().Move(handle, {.position_m = {x, 0, 0}});
    for (int look = 0; look < 20; ++look) {
      const PlacedObject placed = stage.scenes.ListObjects(stage.scene)->front();
      lost_count += placed.object.properties.pose->position_m[0] == x ? 0 : 1;
    }
  }
  updates.join();
  EXPECT_EQ(lost_count, 0);
}

TEST(SceneRegistry, AFloodOfMovesInOneSceneDelaysNoOther) {
  const SceneSpace space{.hearing = {.distance_gain = true}, .listener = {}};
  Stage stage(space);
  const uint32_t handle = stage.Add();
  ObjectChange move;
  move.pose = Pose{.position_m = {1, 0, 0}};
  absl::Status status;
  // Nothing renders, so that nothing takes the moves.
  while (status.ok()) status = stage.scenes.UpdateObject(stage.scene, handle, move).status();
  stage.scene = *stage.scenes.CreateScene(space);
  EXPECT_TRUE(stage.scenes.UpdateObject(stage.scene, stage.Add(), move).ok());
  EXPECT_TRUE(stage.scenes.UpdateListener(stage.scene, {.position_m = {0, 0, 1}}, 0).ok());
}

TEST(BodyCache, ReturnsTheSameBodyWhileAnObjectUsesIt) {
  BodyCache bodies;
  const auto model = SmallModel();
  const auto body = bodies.Get(model);
  ASSERT_TRUE(body.ok());
  EXPECT_EQ(*bodies.Get(model), *body);
  EXPECT_GT((*body)->volume_m3, 0);
}

TEST(BodyCache, KeepsNoMemoryOfBodiesThatNobodyUses) {
  constexpr size_t kBodies = 500;
  BodyCache bodies;
  const auto model = SmallModel();
  const auto make_and_forget = [&] {
    for (size_t i = 0; i < kBodies; ++i) ASSERT_TRUE(bodies.Get(model).ok());
  };
  make_and_forget();
  const size_t before = mallinfo2().uordblks;
  make_and_forget();
  // A sanitizer has a heap of its own, of which mallinfo2 knows nothing.
  EXPECT_LT(mallinfo2().uordblks, before + 50 * kBodies);
}

TEST(SoundingObject, APointIsInMetresOfTheObjectAsLargeAsItIs) {
  Stage stage;
  ObjectProperties properties = SmallProperties();
  properties.material.size = 3;
  const PlacedObject placed = *stage.TryAdd(properties);
  ObjectContact contact = SmallImpulse(1).contact;
  // Half way up an edge of 0.3 m, from vertex 0 to vertex 2.
  contact.impulse.location = Point{0, 0.15, 0};
  BodyImpulses impulses;
  ASSERT_TRUE(
      FindBodyImpulses(contact, PointSource::kClient, placed.object, nullptr, impulses).ok());
  const TrianglePoint& at = impulses.by[0].impulse().at;
  for (size_t corner = 0; corner < 3; ++corner) {
    const uint32_t vertex = at.vertices[corner];
    EXPECT_NEAR(at.weights[corner], vertex == 0 || vertex == 2 ? 0.5 : 0, 1e-6);
  }
}

}  // namespace
}  // namespace carillon
