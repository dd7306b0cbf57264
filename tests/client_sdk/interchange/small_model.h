// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "carillon/v1/material.pb.h"
#include "client_sdk/interchange/complete_model.h"
#include "client_sdk/interchange/stored_model.h"

namespace carillon::interchange {

/// A tetrahedron with three modes of invented shapes, every array of which differs from the others;
/// its surface as given has a corner more.
inline StoredModel SmallModel() {
  StoredModel model;
  model.header.set_solver("test");
  model.header.mutable_settings()->set_poisson_ratio(0.33);
  model.header.set_complete_to_eigenvalue(5.5);
  model.header.set_volume_m3(1.0 / 6);
  model.header.mutable_verification()->set_max_residual(1e-7);
  model.header.add_warnings("a warning");
  for (const float error : {0.01F, 0.02F, 0.03F}) model.header.add_estimated_errors(error);
  model.header.set_mode_count(3);
  model.eigenvalues = {1.0 / 3, 2.5, 5.25};
  model.residuals = {1e-8, 2e-8, 1e-7};
  model.vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  model.triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  model.given_triangle = {3, 2, 1, 0};
  model.given_vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.5, 0.5, 0};
  model.given_triangles = {1, 2, 3, 0, 3, 2, 0, 1, 3, 0, 2, 1};
  for (int i = 0; i < 4 * 3 * 3; ++i) {
    model.shapes.push_back(0.1F * static_cast<float>(i * i % 17) - 0.7F);
  }
  StoredModel coupled = model;
  static_cast<void>(Complete(coupled));
  model.couplings = coupled.couplings;
  return model;
}

/// The surfaces must be equal to the bit: the sounding one, and that which was given.
inline void ExpectSameSurface(const StoredModel& one, const StoredModel& other) {
  EXPECT_EQ(one.vertices, other.vertices);
  EXPECT_EQ(one.triangles, other.triangles);
  EXPECT_EQ(one.given_triangle, other.given_triangle);
  EXPECT_EQ(one.given_vertices, other.given_vertices);
  EXPECT_EQ(one.given_triangles, other.given_triangles);
}

/// A metal.
inline v1::Material SmallMaterial() {
  v1::Material material;
  material.set_young_pa(7e10);
  material.set_poisson_ratio(0.33);
  material.set_density_kg_per_m3(2700);
  material.set_alpha1_s(1e-7);
  material.set_alpha2_per_s(3);
  return material;
}

inline std::string ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace carillon::interchange
