// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_sdk/cli/commands/foley_command.h"
#include "client_sdk/motion/files/motion_scene.h"

namespace carillon::cli {

/// How a body sounds, and what it is in the balance.
struct FoleyBody {
  std::string material;  ///< empty: silent
  std::string scenery;   ///< the material of a silent body that never moves; empty: unknown
  bool endless = false;  ///< the floor of --floor, which has no sound
  double wall_m = 0;     ///< zero: solid
  bool closed = false;
  bool repair = false;
  double material_mass_kg = 0;  ///< by material, volume and wall; zero: unknown
};

/// A motion with all that the command line says of it.
struct FoleyScene {
  motion::MotionScene scene;
  std::vector<FoleyBody> bodies;
};

/// Reads the file, and gives the bodies surfaces, materials, masses and a floor. Errors: as for
/// MakeFoley.
absl::StatusOr<FoleyScene> ReadFoleyScene(const FoleyOptions& options);

/// Makes all of a body but its motion larger by a factor. Its mass stays.
void ScaleShape(double factor, motion::MovingBody& body);

}  // namespace carillon::cli
