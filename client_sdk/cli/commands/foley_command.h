// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/program.h"

namespace carillon::cli {

/// A shell pattern of names of bodies, and what it gives them.
using BodyChoice = std::pair<std::string, std::string>;

/// The options of `carillon foley`.
struct FoleyOptions {
  std::string file;
  std::vector<BodyChoice> materials, meshes, walls, masses;
  std::vector<std::string> driven, repaired;
  std::optional<double> floor_m;  ///< height of an endless floor against gravity
  std::optional<std::array<double, 3>> gravity_m_per_s2;
  double metres_per_unit = 1;
  std::optional<double> friction;  ///< that of the file, or 0.6, unless it is given
  std::string silent_striker = "steel";
  double roughness_depth = 0;
  std::string listener;  ///< a camera's name; empty: the first one, if two channels are asked for
  std::vector<double> cuts_s;  ///< times of the file when the listener jumps
  std::string trace;           ///< the contact trace to keep
  std::string stems;           ///< a folder for the sound of each body alone
  bool list = false, force = false;
  bool frames_are_steps = false;
  /// Impulses are scaled to the masses that the materials give.
  bool material_masses = false;
  RenderOptions sound;  ///< `trace` is not used
};

/// Makes the motion of bodies audible: finds the contacts that explain it, computes the bodies'
/// models, and renders the contacts. Errors: those of ReadGltfMotion, ReadPoseTable, FindContacts,
/// of models and of Render, and InvalidArgument (BODY_UNKNOWN, SURFACE_OPEN, MOTION_UNEXPLAINED,
/// MOTION_UNIT_WRONG, MOTION_WITHOUT_CONTACT).
absl::Status MakeFoley(const Program& program, const FoleyOptions& options);

}  // namespace carillon::cli
