// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "carillon/v1/contact.pb.h"

namespace carillon::wind_chimes {

/// Six tubes hung from threads around a wooden clapper that a gust drives: a rigid-body simulation
/// in Bullet that knows nothing of sound. The same seed gives the same contacts.
class WindChimes {
 public:
  /// One step of the simulation, solved in kSubsteps; contacts are read out after each of these.
  static constexpr double kStep_s = 1.0 / 240;
  static constexpr int kSubsteps = 4;

  explicit WindChimes(uint64_t seed);
  ~WindChimes();

  /// Advances by one step and returns its strikes, the tubes being handles 1 to 6 in the order of
  /// kTubes and their frames those of WriteTubeMesh.
  v1::ContactStep Step();

 private:
  class World;
  std::unique_ptr<World> world_;
};

}  // namespace carillon::wind_chimes
