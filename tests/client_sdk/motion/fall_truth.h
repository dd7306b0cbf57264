// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client_sdk/examples/falls/fall.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// A blow of one pair of bodies, its contact points taken together.
struct PairBlow {
  uint32_t a = 0, b = 0;
  double time_s = 0;
  Vector impulse = Vector::Zero();  ///< on a, in the scene's axes, N s
  Vector point_m = Vector::Zero();  ///< in a's frame
};

/// A fall in an engine at 2400 steps a second: its poses at the frames, rounded to 32 bits, and the
/// blows that the engine computed.
struct Fall {
  Motion motion;
  std::vector<PairBlow> blows;
};

using Engine = std::function<falls::Simulation(const falls::FallScene&, double step_s)>;

/// Lets a scene fall, and gives the poses of every `steps_per_frame`-th step.
Fall Drop(const falls::FallScene& scene, const Engine& engine, int steps_per_frame,
          double step_s = 1.0 / 2400);

/// The blows of a reconstruction, taken together for each pair within 8 ms.
std::vector<PairBlow> Clustered(const Motion& motion, const FoundContacts& found);

/// How blows that were found compare with those of the engine. Blows of less than 3 % of the
/// strongest one (by impulse over the root of the reduced mass) do not count.
struct Likeness {
  int true_count = 0, found_count = 0, false_count = 0;
  double found_share = 0, false_share = 0;  ///< of the true impulse
  double median_dt_s = 0, dt90_s = 0;
  double median_size_error = 0, median_vector_error = 0;
  double median_point_m = 0;
};
Likeness Compare(const Fall& fall, const FoundContacts& contacts);

/// Bodies without a model or a material, which rest at the origin.
falls::Body BoxBody(const std::string& name, const falls::Vector& sides_m, double mass_kg);
falls::Body BallBody(const std::string& name, double radius_m, double mass_kg);
falls::Body FloorBody();

/// The surface, the mass and the moments of a body, without poses.
MovingBody ToMoving(const falls::Body& body);

/// The scenes of the tests and of the benchmark.
falls::FallScene CornerScene();
falls::FallScene BounceScene();
falls::FallScene AirScene();
falls::FallScene BlocksScene(int pile = 0);

}  // namespace carillon::motion
