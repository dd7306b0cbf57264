// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "carillon/v1/contact.pb.h"

namespace carillon::wind_chimes {

/// A rigid-body simulation in Bullet of six tubes that hang from threads around a wooden clapper. A
/// gust of wind drives the clapper. The same seed gives the same contacts.
class WindChimes {
 public:
  /// The time step of the simulation.
  static constexpr double kStep_s = 1.0 / 960;

  explicit WindChimes(uint64_t seed);
  ~WindChimes();

  /// Advances by one step and returns its contacts. The tubes are the objects 1 to 6 in the order
  /// of kTubes, and their frames are those of WriteTubeMesh.
  v1::ContactStep Step();

 private:
  class World;
  std::unique_ptr<World> world_;
};

}  // namespace carillon::wind_chimes
