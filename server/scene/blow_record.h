// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace carillon {

/// The record of an impulse on an object of a simulation, as it sounds, for the reports of offline
/// renderings.
struct BlowRecord {
  double time_s = 0;  ///< time from the first frame to the middle of the contact as it sounds
  uint32_t handle = 0;
  std::optional<uint32_t> by;       ///< the other body, if the contact named it
  bool by_sounds = false;           ///< whether `by` is the handle of an object
  std::array<double, 3> point_m{};  ///< point on the surface, in the object's frame at its size
  std::array<float, 3> impulse_newton_seconds{};  ///< impulse on the object, in its frame
  double duration_s = 0;                          ///< duration of the contact
};

}  // namespace carillon
