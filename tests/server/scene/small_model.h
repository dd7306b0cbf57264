// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "server/mode_database/codec/modal_model.h"
#include "server/scene/object_contact.h"
#include "server/scene/sounding_object.h"

namespace carillon {

inline constexpr double kTestYoungPa = 7e10;
inline constexpr double kTestDensityKgPerM3 = 2700;
/// Natural frequencies of SmallModel made of SmallProperties.
inline constexpr double kTestFrequenciesHz[] = {440, 1000, 5000};

/// Aluminum, about, that rings for a fraction of a second.
inline ObjectProperties SmallProperties() {
  return {.material = {.young_pa = kTestYoungPa,
                       .density_kg_per_m3 = kTestDensityKgPerM3,
                       .alpha1_s = 1e-7,
                       .alpha2_per_s = 20},
          .poisson_ratio = 0.33};
}

/// A tetrahedron of 0.1 m with three modes that all move along x, everywhere alike; 1 N s along x
/// sounds at about -53 dB of full scale.
inline std::shared_ptr<const ModalModel> SmallModel() {
  auto model = std::make_shared<ModalModel>();
  model->digest = std::string(64, 'a');
  model->poisson_ratio = 0.33;
  for (const double frequency_hz : kTestFrequenciesHz) {
    model->eigenvalues.push_back(std::pow(2 * std::numbers::pi * frequency_hz, 2) *
                                 kTestDensityKgPerM3 / kTestYoungPa);
    model->couplings.push_back(1);
  }
  model->complete_to_eigenvalue = model->eigenvalues.back() * 100;  // up to 50 kHz
  model->vertices = {{0, 0, 0}, {0.1F, 0, 0}, {0, 0.1F, 0}, {0, 0, 0.1F}};
  model->triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  model->given_triangle = {0, 1, 2, 3};
  model->given_vertices = model->vertices;
  model->given_triangles = model->triangles;
  for (size_t vertex = 0; vertex < 4; ++vertex) {
    model->shapes.insert(model->shapes.end(), {1, 1, 1, 0, 0, 0, 0, 0, 0});
  }
  return model;
}

/// `newton_seconds` along x at the origin of object `handle`, in an instant.
inline ObjectImpulse SmallImpulse(uint32_t handle, double newton_seconds = 1,
                                  double time_offset_s = 0) {
  ObjectImpulse impulse;
  impulse.time_offset_s = time_offset_s;
  impulse.contact.handle = handle;
  impulse.contact.impulse.location = Point{0, 0, 0};
  impulse.contact.impulse.impulse_newton_seconds = {newton_seconds, 0, 0};
  impulse.contact.impulse.duration_s = 0;
  return impulse;
}

}  // namespace carillon
