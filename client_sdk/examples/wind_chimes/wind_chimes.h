// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "carillon/v1/contact.pb.h"

namespace carillon::wind_chimes {

/// The time step of the simulation.
inline constexpr double kStep_s = 1.0 / 960;

/// Handles of the silent parts in a simulation for a picture.
inline constexpr uint32_t kClapperHandle = 7, kSailHandle = 8;

/// The purpose of a simulation.
enum class Purpose {
  kSound,    ///< contacts of the tubes
  kPicture,  ///< poses of the tubes, of the clapper and of the sail, as if all of them sounded
};

/// Advances a simulation by one step and returns its contacts. The tubes are the objects 1 to 6 in
/// the order of kTubes, and their frames are those of WriteTubeMesh.
using Simulation = std::function<v1::ContactStep()>;

/// Simulates in Bullet six tubes that hang from threads around a wooden clapper. The wind drives
/// the clapper in gusts. Two simulations with the same seed give the same contacts.
Simulation Chimes(uint64_t seed, Purpose purpose = Purpose::kSound);

}  // namespace carillon::wind_chimes
