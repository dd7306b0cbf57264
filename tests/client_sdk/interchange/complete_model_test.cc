// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/complete_model.h"

#include <gtest/gtest.h>

#include <cmath>

namespace carillon::interchange {
namespace {

/// A right triangle in the plane z = 0, legs of two and three, whose corners move by these along z.
StoredModel Triangle(float a, float b, float c) {
  StoredModel model;
  model.eigenvalues = {4};
  model.vertices = {0, 0, 0, 2, 0, 0, 0, 3, 0};
  model.triangles = {0, 1, 2};
  model.shapes = {9, 9, a, 9, 9, b, 9, 9, c};  // along the plane no air is moved
  return model;
}

double Coupling(float a, float b, float c) {
  StoredModel model = Triangle(a, b, c);
  EXPECT_TRUE(Complete(model).ok());
  return model.couplings.at(0);
}

/// sqrt(4) times the integral of |f| over the triangle, by cells so small that what is left of the
/// error comes of those that the zero of f crosses: 1e-5.
double CouplingByCells(double a, double b, double c) {
  constexpr int kCells = 1000;
  double sum = 0;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; i + j < kCells; ++j) {
      const double u = (i + 1.0 / 3) / kCells, v = (j + 1.0 / 3) / kCells;
      sum += std::abs(a + u * (b - a) + v * (c - a));
      if (i + j + 1 == kCells) continue;
      sum += std::abs(a + (u + 1.0 / 3 / kCells) * (b - a) + (v + 1.0 / 3 / kCells) * (c - a));
    }
  }
  return 2 * sum * 3 / (kCells * kCells);
}

TEST(CompleteModel, ACouplingIsTheIntegralOfWhatMovesAlongTheNormal) {
  EXPECT_DOUBLE_EQ(Coupling(1, 1, 1), 6);
  EXPECT_DOUBLE_EQ(Coupling(-1, -1, -1), 6);
  EXPECT_DOUBLE_EQ(Coupling(0, 3, 0), 6);
  for (const auto& [a, b, c] : {std::array{1.F, -1.F, 2.F}, std::array{-3.F, 1.F, 2.F},
                                std::array{0.F, 1.F, -1.F}, std::array{2.F, -1.F, -0.5F}}) {
    EXPECT_NEAR(Coupling(a, b, c), CouplingByCells(a, b, c), 1e-4) << a << b << c;
  }
}

TEST(CompleteModel, WhatIsLeftOutIsTheSoundingSurfaceItself) {
  StoredModel model = Triangle(1, 1, 1);
  model.header.mutable_verification()->set_max_residual(1e-9);
  model.header.add_estimated_errors(0.1F);
  model.header.add_estimated_errors(0.1F);
  ASSERT_TRUE(Complete(model).ok());
  EXPECT_EQ(model.given_triangles, model.triangles);
  EXPECT_EQ(model.given_vertices, model.vertices);
  EXPECT_EQ(model.residuals, std::vector{1e-9});
  EXPECT_EQ(model.header.complete_to_eigenvalue(), 4);
  EXPECT_EQ(model.header.estimated_errors_size(), 0) << "two, but there is one mode";
}

}  // namespace
}  // namespace carillon::interchange
