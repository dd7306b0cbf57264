// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/model_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "precompute/pipeline/model_warnings.h"
#include "precompute/pipeline/usual_goal.h"
#include "precompute/pipeline/worker_request.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Steel at the size of its mesh, from 100 to 1000 Hz.
constexpr double kLowHz = 100, kHighHz = 1000;
IntendedUse Use() {
  return {.young_pa = 210e9, .density_kg_per_m3 = 7850, .low_hz = kLowHz, .high_hz = kHighHz};
}

/// A model with modes of these frequencies and estimated errors, whose shapes tell them apart.
ModalModel ModelWith(const std::vector<double>& frequencies_hz, const std::vector<double>& errors) {
  ModalModel model;
  model.vertices = {{0, 0, 0}};
  for (const double hz : frequencies_hz) model.eigenvalues.push_back(Use().UnitEigenvalue(hz));
  model.estimated_errors = errors;
  model.poisson_slopes.assign(errors.size(), 0);
  model.residuals.assign(errors.size(), 0);
  model.couplings.assign(errors.size(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t m = 0; m < errors.size(); ++m) {
      model.shapes.push_back(static_cast<float>(10 * m) + static_cast<float>(axis));
    }
  }
  model.lowest_eigenvalue = model.eigenvalues.empty() ? 0 : model.eigenvalues[0];
  model.complete_to_eigenvalue = Use().UnitEigenvalue(kHighHz);
  return model;
}

TEST(CheckBand, AModeMustLieAtTheLowerEndOfTheBandOrAbove) {
  EXPECT_TRUE(CheckBand(ModelWith({50, kLowHz * 1.001}, {0, 0}), Use()).ok());
  const absl::Status refused = CheckBand(ModelWith({50, 90}, {0, 0}), Use());
  EXPECT_THAT(refused.ToString(), HasSubstr("NO_MODE_IN_BAND"));
  EXPECT_THAT(refused.ToString(),
              HasSubstr("its first is 50 Hz and the last below the band is 90"));
}

/// A hundred wavelengths of 5172 m/s at 20 kHz are 25.9 m, and at 1 kHz 517 m.
TEST(CheckUnit, ABodyOfMoreThan20MetresAndAHundredWavelengthsNeedsAUnit) {
  IntendedUse use = Use();
  EXPECT_TRUE(CheckUnit(202, use).ok()) << "it costs little up to 1 kHz";
  use.high_hz = 20'000;
  EXPECT_TRUE(CheckUnit(25, use).ok());
  EXPECT_EQ(ToErrorInfo(CheckUnit(27, use)).reason(), "MESH_UNIT_UNCLEAR");
  use.young_pa = 1e6;
  EXPECT_TRUE(CheckUnit(19, use).ok()) << "a jelly of a usual size";
  use.size = 2;
  EXPECT_TRUE(CheckUnit(202, use).ok()) << "whoever scales a body knows its unit";
}

TEST(IsSurelyAboveBand, TheLowestModeMustLieAboveByMoreThanTwiceItsError) {
  ModalModel model = ModelWith({}, {});
  model.lowest_error = 0.1;
  model.lowest_eigenvalue = Use().UnitEigenvalue(kHighHz * 1.19);
  EXPECT_FALSE(IsSurelyAboveBand(model, Use()));
  model.lowest_eigenvalue = Use().UnitEigenvalue(kHighHz * 1.21);
  EXPECT_TRUE(IsSurelyAboveBand(model, Use()));
  EXPECT_FALSE(IsSurelyAboveBand(ModelWith({2 * kHighHz}, {0}), Use())) << "it has a mode";
}

TEST(MayBeTooSmall, ACubeOfAMillimetreMayBeAndOneOfTenMetresMayNot) {
  EXPECT_TRUE(MayBeTooSmall(MakeBoxSurface({1e-3, 1e-3, 1e-3}), Use()));
  EXPECT_FALSE(MayBeTooSmall(MakeBoxSurface({10, 10, 10}), Use()));
  EXPECT_FALSE(MayBeTooSmall(MakeBoxSurface({1e-3, 1e-3, 1e-6}), Use())) << "it is no compact body";
}

TEST(LeaveOutInaccurate, TheKeptModesAreThoseWithinTheLimitAndTheModelEndsBelowTheOthers) {
  ModalModel model = ModelWith({200, 300, 400}, {0.01, 0.05, 0.02});
  ASSERT_TRUE(LeaveOutInaccurate(0.03, Use(), model).ok());
  EXPECT_THAT(model.eigenvalues, ElementsAre(Use().UnitEigenvalue(200), Use().UnitEigenvalue(400)));
  EXPECT_THAT(model.estimated_errors, ElementsAre(0.01, 0.02));
  EXPECT_THAT(model.shapes, ElementsAre(0, 20, 1, 21, 2, 22));
  EXPECT_EQ(model.complete_to_eigenvalue, std::nextafter(Use().UnitEigenvalue(300), 0));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_THAT(model.warnings[0], HasSubstr("1 modes, the lowest at 300 Hz, were left out"));
}

worker::v1::WorkerRequest Steel() {
  worker::v1::WorkerRequest request;
  request.mutable_settings()->set_poisson_ratio(0.3);
  request.mutable_material()->set_young_pa(210e9);
  request.mutable_material()->set_poisson_ratio(0.3);
  request.mutable_material()->set_density_kg_per_m3(7850);
  request.mutable_material()->set_alpha1_s(0);
  request.mutable_material()->set_alpha2_per_s(0);
  return request;
}

TEST(WorkerRequest, ACompleteRequestHasEveryDefault) {
  const auto complete = Complete(Steel()).value();
  EXPECT_EQ(complete.size(), 1);
  EXPECT_EQ(MetresPerUnit(complete.settings()), 1);
  EXPECT_EQ(MeshingOf(complete).nodes_per_element, 10);
  EXPECT_EQ(MassSharingOf(complete), MassSharing::kConsistent);
  EXPECT_FALSE(GoalOf(complete).given());
  EXPECT_EQ(UseOf(complete).high_hz, 20'000);
  EXPECT_TRUE(UseOf(complete).high_is_default);
  EXPECT_FALSE(complete.has_transfer());
}

TEST(WorkerRequest, WhatIsAskedForArrivesInTheUnitsOfTheRooms) {
  worker::v1::WorkerRequest request = Steel();
  v1::DecompositionSettings& settings = *request.mutable_settings();
  settings.set_element(v1::ELEMENT_LINEAR);
  settings.set_mass_matrix(v1::MASS_MATRIX_LUMPED);
  settings.mutable_mesh()->set_target_node_count(500);
  settings.mutable_mesh()->set_keep_surface(true);
  settings.mutable_mesh()->set_accuracy(0.01);
  settings.mutable_mesh()->set_budget_s(60);
  settings.mutable_mesh()->set_budget_gib(1.5);
  request.set_size(2);
  request.set_min_frequency_hz(100);
  request.set_max_frequency_hz(1000);
  request.set_cautious(true);
  const auto complete = Complete(request).value();
  const MeshingSettings meshing = MeshingOf(complete);
  EXPECT_EQ(meshing.target_node_count, 500);
  EXPECT_EQ(meshing.nodes_per_element, 4);
  EXPECT_TRUE(meshing.keep_surface.value());
  EXPECT_TRUE(meshing.cautious);
  EXPECT_EQ(MassSharingOf(complete), MassSharing::kLumped);
  const ResolutionGoal goal = GoalOf(complete);
  EXPECT_EQ(goal.accuracy, 0.01);
  EXPECT_EQ(goal.budget_s, 60);
  EXPECT_EQ(goal.budget_bytes, 1.5 * (1 << 30));
  const IntendedUse use = UseOf(complete);
  EXPECT_EQ(use.size, 2);
  EXPECT_EQ(use.low_hz, 100);
  EXPECT_EQ(use.high_hz, 1000);
  EXPECT_FALSE(use.high_is_default);
}

TEST(WorkerRequest, RefusesFiguresThatNoBodyCanHave) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(worker::v1::WorkerRequest&)>> faults = {
      [](worker::v1::WorkerRequest& r) { r.set_size(-1); },
      [](worker::v1::WorkerRequest& r) { r.set_size(std::numeric_limits<double>::infinity()); },
      [](worker::v1::WorkerRequest& r) { r.set_min_frequency_hz(20'000); },
      [](worker::v1::WorkerRequest& r) { r.set_max_frequency_hz(2e9); },
      [](worker::v1::WorkerRequest& r) { r.mutable_settings()->set_poisson_ratio(0.5); },
      [](worker::v1::WorkerRequest& r) {
        r.mutable_settings()->mutable_mesh()->set_accuracy(kNan);
      },
      [](worker::v1::WorkerRequest& r) { r.mutable_material()->clear_density_kg_per_m3(); },
      [](worker::v1::WorkerRequest& r) { r.mutable_transfer()->set_accuracy_db(0.01); },
      [](worker::v1::WorkerRequest& r) { r.mutable_transfer()->set_budget_s(-1); }};
  for (size_t i = 0; i < faults.size(); ++i) {
    worker::v1::WorkerRequest request = Steel();
    faults[i](request);
    EXPECT_THAT(Complete(request).status().ToString(), HasSubstr("INVALID_SETTINGS")) << i;
  }
}

}  // namespace
}  // namespace carillon::precompute
