// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/pipeline/worker_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <vector>

#include "proto/cpp/decomposition_settings.h"

namespace carillon::precompute {
namespace {

using ::testing::HasSubstr;

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
